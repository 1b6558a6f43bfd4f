// A quarter of a ring around another, with nothing shared.
DefineConstant[ ni = {6, Name "ni"} ];   // elements along the contact surface of the inner ring
DefineConstant[ no = {8, Name "no"} ];   // and of the outer one
DefineConstant[ gap = {0, Name "gap"} ]; // distance between them
r() = {0.5, 1, 1 + gap, 1.6 + gap};

Point(1) = {0, 0, 0};
For k In {0 : 3}
  p = 10*(k + 1);
  Point(p + 1) = {r(k), 0, 0};
  Point(p + 2) = {0, r(k), 0};
  Circle(p) = {p + 1, 1, p + 2};
EndFor
For p In {10 : 30 : 20}
  q = p + 10;
  n = p == 10 ? ni : no;
  Line(p + 1) = {p + 1, q + 1};
  Line(p + 2) = {p + 2, q + 2};
  Transfinite Curve {p, q} = n + 1;
  Transfinite Curve {p + 1, p + 2} = Ceil(n/2) + 1;
  Curve Loop(p) = {p + 1, q, -(p + 2), -p};
  Plane Surface(p) = {p};
  Transfinite Surface {p};
EndFor

Physical Surface("inner") = {10};
Physical Curve("inner_y") = {11};
Physical Curve("inner_x") = {12};
Physical Curve("inner_contact") = {20};
Physical Surface("outer") = {30};
Physical Curve("outer_y") = {31};
Physical Curve("outer_x") = {32};
Physical Curve("outer_face") = {40};
Physical Curve("outer_contact") = {30};
