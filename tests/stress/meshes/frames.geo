// A leaf b1 and portal frames b2 and, with `two`, b3, which stand on it and on each other; with a `leaf` a leaf lies on the last. y is up.
DefineConstant[ two = {0, Name "two"} ];
DefineConstant[ leaf = {0, Name "leaf"} ];
DefineConstant[ tall = {0.5, Name "tall"} ];     // height of the frames; the first is 1 wide
DefineConstant[ wide = {0.6, Name "wide"} ];     // width of the second frame
DefineConstant[ t1 = {0.1, Name "t1"}, t2 = {0.05, Name "t2"}, t3 = {0.05, Name "t3"} ]; // thickness of the leaf, the frames and the leaf on top
DefineConstant[ n1 = {8, Name "n1"}, n2 = {8, Name "n2"}, n3 = {8, Name "n3"} ];         // elements along them
DefineConstant[ through = {1, Name "through"} ]; // elements through a leaf or a bar

// leaves: below, and on top
top = (1 + two)*tall;
For i In {0 : leaf}
  body = (i == 0) ? 1 : 3 + two;
  n = (i == 0) ? n1 : n3;
  left = (i == 0) ? -0.1 : (two ? 0.5 - 0.5*wide : 0);
  right = (i == 0) ? 1.1 : (two ? 0.5 + 0.5*wide : 1);
  low = (i == 0) ? -t1 : top;
  high = (i == 0) ? 0 : top + t3;
  p = 100*body;
  Point(p) = {left, low, 0};
  Point(p + 1) = {right, low, 0};
  Point(p + 2) = {right, high, 0};
  Point(p + 3) = {left, high, 0};
  Line(p) = {p, p + 1};
  Line(p + 1) = {p + 1, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p};
  Transfinite Curve {p, p + 2} = n + 1;
  Transfinite Curve {p + 1, p + 3} = through + 1;
  Curve Loop(p) = {p, p + 1, p + 2, p + 3};
  Plane Surface(p) = {p};
  Transfinite Surface {p} = {p, p + 1, p + 2, p + 3} Left;
  Physical Surface(Sprintf("b%g", body)) = {p};
  Physical Curve(Sprintf("b%g_bottom", body)) = {p};
  Physical Curve(Sprintf("b%g_right", body)) = {p + 1};
  Physical Curve(Sprintf("b%g_top", body)) = {p + 2};
  Physical Curve(Sprintf("b%g_left", body)) = {p + 3};
  Physical Point(Sprintf("b%g_pin", body)) = {p + 3};
EndFor

// a frame: two legs, two corners and a bar, which share their sides
For i In {0 : two}
  body = 2 + i;
  left = (i == 0) ? 0 : 0.5 - 0.5*wide;
  right = (i == 0) ? 1 : 0.5 + 0.5*wide;
  low = i*tall;
  high = low + tall;
  p = 100*body;
  Point(p) = {left, low, 0};
  Point(p + 1) = {left + t2, low, 0};
  Point(p + 2) = {left + t2, high - t2, 0};
  Point(p + 3) = {right - t2, high - t2, 0};
  Point(p + 4) = {right - t2, low, 0};
  Point(p + 5) = {right, low, 0};
  Point(p + 6) = {right, high - t2, 0};
  Point(p + 7) = {right, high, 0};
  Point(p + 8) = {right - t2, high, 0};
  Point(p + 9) = {left + t2, high, 0};
  Point(p + 10) = {left, high, 0};
  Point(p + 11) = {left, high - t2, 0};
  For k In {0 : 10}
    Line(p + k) = {p + k, p + k + 1};
  EndFor
  Line(p + 11) = {p + 11, p};
  Line(p + 12) = {p + 2, p + 11};
  Line(p + 13) = {p + 2, p + 9};
  Line(p + 14) = {p + 3, p + 8};
  Line(p + 15) = {p + 3, p + 6};
  Transfinite Curve {p, p + 4, p + 6, p + 7, p + 9, p + 10, p + 12, p + 13, p + 14, p + 15} = through + 1;
  Transfinite Curve {p + 1, p + 3, p + 5, p + 11} = Max(1, Round(n2*tall)) + 1;
  Transfinite Curve {p + 2, p + 8} = n2 + 1;
  Curve Loop(p) = {p, p + 1, p + 12, p + 11};
  Curve Loop(p + 1) = {-(p + 12), p + 13, p + 9, p + 10};
  Curve Loop(p + 2) = {p + 2, p + 14, p + 8, -(p + 13)};
  Curve Loop(p + 3) = {p + 15, p + 6, p + 7, -(p + 14)};
  Curve Loop(p + 4) = {p + 3, p + 4, p + 5, -(p + 15)};
  For k In {0 : 4}
    Plane Surface(p + k) = {p + k};
  EndFor
  Transfinite Surface {p : p + 4};
  Physical Surface(Sprintf("b%g", body)) = {p : p + 4};
  Physical Curve(Sprintf("b%g_bottom", body)) = {p, p + 4};
  Physical Curve(Sprintf("b%g_top", body)) = {p + 7, p + 8, p + 9};
  Physical Point(Sprintf("b%g_pin", body)) = {p + 10};
EndFor
