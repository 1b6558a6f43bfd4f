// An eighth of a spherical shell around another, with nothing shared.
DefineConstant[ hi = {0.3, Name "hi"} ];   // size of elements in the inner shell
DefineConstant[ ho = {0.2, Name "ho"} ];   // and in the outer one
DefineConstant[ gap = {0, Name "gap"} ];   // distance between them
r() = {0.5, 1, 1 + gap, 1.6 + gap};
h() = {hi, hi, ho, ho};

// Spheres 0 to 3 from the inside: points and arcs 11 12 13, 21 22 23, ...
Point(1) = {0, 0, 0};
For k In {0 : 3}
  p = 10*(k + 1);
  Point(p + 1) = {r(k), 0, 0, h(k)};
  Point(p + 2) = {0, r(k), 0, h(k)};
  Point(p + 3) = {0, 0, r(k), h(k)};
  Circle(p + 1) = {p + 1, 1, p + 2};
  Circle(p + 2) = {p + 2, 1, p + 3};
  Circle(p + 3) = {p + 3, 1, p + 1};
  Curve Loop(p) = {p + 1, p + 2, p + 3};
  Surface(p) = {p} In Sphere {1};
EndFor

// The shells, with their faces in the planes z = 0, x = 0, y = 0.
For p In {10 : 30 : 20}
  q = p + 10;
  For i In {1 : 3}
    Line(p + 3 + i) = {p + i, q + i};
  EndFor
  For i In {1 : 3}
    j = (i % 3) + 1;
    Curve Loop(p + i) = {p + i, p + 3 + j, -(q + i), -(p + 3 + i)};
    Plane Surface(p + i) = {p + i};
  EndFor
  Surface Loop(p) = {p, p + 1, p + 2, p + 3, q};
  Volume(p) = {p};
EndFor

Physical Volume("inner") = {10};
Physical Surface("inner_z") = {11};
Physical Surface("inner_x") = {12};
Physical Surface("inner_y") = {13};
Physical Surface("inner_contact") = {20};
Physical Volume("outer") = {30};
Physical Surface("outer_z") = {31};
Physical Surface("outer_x") = {32};
Physical Surface("outer_y") = {33};
Physical Surface("outer_face") = {40};
Physical Surface("outer_contact") = {30};
