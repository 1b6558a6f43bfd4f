// The right half of a thin ring b2 of radius 1 that touches a plate b1 at the origin; with `inner` a ring within it, which touches it all around, and
// with `pressed` a plate on top, the last body. y is up.
DefineConstant[ inner = {0, Name "inner"} ];
DefineConstant[ pressed = {1, Name "pressed"} ];
DefineConstant[ t1 = {0.1, Name "t1"}, t2 = {0.1, Name "t2"}, t3 = {0.1, Name "t3"} ]; // plates, ring, inner ring
DefineConstant[ n1 = {8, Name "n1"}, n2 = {8, Name "n2"}, n3 = {8, Name "n3"} ];       // elements along them
DefineConstant[ through = {1, Name "through"} ]; // elements through them

For i In {0 : pressed}
  body = (i == 0) ? 1 : 3 + inner;
  low = (i == 0) ? -t1 : 2;
  high = (i == 0) ? 0 : 2 + t1;
  p = 100*body;
  Point(p) = {0, low, 0};
  Point(p + 1) = {1, low, 0};
  Point(p + 2) = {1, high, 0};
  Point(p + 3) = {0, high, 0};
  Line(p) = {p, p + 1};
  Line(p + 1) = {p + 1, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p};
  Transfinite Curve {p, p + 2} = n1 + 1;
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

// a ring in three parts, which share their ends: below, beside, above
For i In {0 : inner}
  body = 2 + i;
  t = (i == 0) ? t2 : t3;
  n = (i == 0) ? n2 : n3;
  r = (i == 0) ? 1 : 1 - t2;
  p = 100*body;
  Point(p + 20) = {0, 1, 0};
  For k In {0 : 3}
    angle = -Pi/2 + k*Pi/3;
    Point(p + k) = {(k % 3 == 0) ? 0 : r*Cos(angle), 1 + r*Sin(angle), 0};
    Point(p + 4 + k) = {(k % 3 == 0) ? 0 : (r - t)*Cos(angle), 1 + (r - t)*Sin(angle), 0};
    Line(p + 6 + k) = {p + k, p + 4 + k};
    Transfinite Curve {p + 6 + k} = through + 1;
  EndFor
  For k In {0 : 2}
    Circle(p + k) = {p + k, p + 20, p + k + 1};
    Circle(p + 3 + k) = {p + 4 + k, p + 20, p + 5 + k};
    Transfinite Curve {p + k, p + 3 + k} = Max(1, Round(n/3)) + 1;
    Curve Loop(p + k) = {p + k, p + 7 + k, -(p + 3 + k), -(p + 6 + k)};
    Plane Surface(p + k) = {p + k};
    Transfinite Surface {p + k} = {p + k, p + k + 1, p + 5 + k, p + 4 + k};
  EndFor
  Physical Surface(Sprintf("b%g", body)) = {p : p + 2};
  If(i == 0)
    Physical Curve(Sprintf("b%g_bottom", body)) = {p};
    Physical Curve(Sprintf("b%g_top", body)) = {p + 2};
  Else
    Physical Curve(Sprintf("b%g_outside", body)) = {p : p + 2};
  EndIf
  Physical Curve(Sprintf("b%g_inside", body)) = {p + 3 : p + 5};
  Physical Curve(Sprintf("b%g_left", body)) = {p + 6, p + 9};
EndFor
