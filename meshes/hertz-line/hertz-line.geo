// Two quarter cylinders that touch at the origin, the lower one of radius R1, the upper one of radius R2: x = 0 is their
// plane of symmetry, the flat faces go through their axes. Elements of size a/n around the contact, growing outwards.
SetFactory("OpenCASCADE");
DefineConstant[ n = {8, Name "n"} ];   // elements along the half-width a = 1 that the contact has under the load of the scene
DefineConstant[ R1 = {60, Name "R1"} ];
DefineConstant[ R2 = {40, Name "R2"} ];

a = 1;
wide = 3*a; // half-width of the surfaces that may touch

R() = {R1, R2};
up() = {-1, 1}; // to the axis of the cylinder

For s In {0 : 1}
  p = 10*s + 1;
  angle = Asin(wide/R(s));
  Point(p) = {0, 0, 0};
  Point(p + 1) = {wide, up(s)*R(s)*(1 - Cos(angle)), 0};
  Point(p + 2) = {R(s), up(s)*R(s), 0};
  Point(p + 3) = {0, up(s)*R(s), 0};
  Circle(p) = {p, p + 3, p + 1};
  Circle(p + 1) = {p + 1, p + 3, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p};
  Curve Loop(p) = {p, p + 1, p + 2, p + 3};
  Plane Surface(p) = {p};
EndFor

Physical Surface("lower") = {1};
Physical Curve("lower_top") = {1};
Physical Curve("lower_face") = {3};
Physical Curve("lower_axis") = {4};
Physical Surface("upper") = {11};
Physical Curve("upper_bottom") = {11};
Physical Curve("upper_face") = {13};
Physical Curve("upper_axis") = {14};

Field[1] = Distance;
Field[1].PointsList = {1};
Field[2] = Threshold;
Field[2].InField = 1;
Field[2].SizeMin = a/n;
Field[2].DistMin = 1.5*a;
Field[2].SizeMax = 0.15*R2;
Field[2].DistMax = R2/2;
Background Field = 2;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
