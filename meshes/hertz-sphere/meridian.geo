// The meridians of two spheres of radius R that touch at the origin, each cut to a cylinder of radius and height `size` around
// the contact; x = 0 is the axis. Elements of size a/n around the contact, smaller at its edge, growing outwards.
DefineConstant[ n = {8, Name "n"} ];       // elements along the radius a = 1 that the contact has under the load of the scene
DefineConstant[ edge = {4, Name "edge"} ]; // how many times smaller they are where that contact ends
DefineConstant[ R = {50, Name "R"} ];

a = 1;
size = 20;    // of the cylinders: far enough from the contact
wide = 2.5*a; // radius of the surfaces that may touch

up() = {-1, 1}; // from the contact to the centre of the sphere

For s In {0 : 1}
  p = 10*s + 1;
  Point(p) = {0, 0, 0};
  Point(p + 1) = {wide, up(s)*(R - Sqrt(R^2 - wide^2)), 0};
  Point(p + 2) = {size, up(s)*(R - Sqrt(R^2 - size^2)), 0};
  Point(p + 3) = {size, up(s)*size, 0};
  Point(p + 4) = {0, up(s)*size, 0};
  Point(p + 5) = {0, up(s)*R, 0};
  Circle(p) = {p, p + 5, p + 1};
  Circle(p + 1) = {p + 1, p + 5, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p + 4};
  Line(p + 4) = {p + 4, p};
  Curve Loop(p) = {p, p + 1, p + 2, p + 3, p + 4};
  Plane Surface(p) = {p};
EndFor

Physical Surface("lower") = {1};
Physical Curve("lower_top") = {1};
Physical Curve("lower_face") = {4};
Physical Surface("upper") = {11};
Physical Curve("upper_bottom") = {11};
Physical Curve("upper_face") = {14};

Field[1] = Distance;
Field[1].PointsList = {1};
Field[2] = Threshold;
Field[2].InField = 1;
Field[2].SizeMin = a/n;
Field[2].DistMin = 1.2*a;
Field[2].SizeMax = size/4;
Field[2].DistMax = size;
Field[3] = MathEval; // distance from the circle of radius a
Field[3].F = Sprintf("Sqrt((x - %g)^2 + y^2)", a);
Field[4] = Threshold;
Field[4].InField = 3;
Field[4].SizeMin = a/n/edge;
Field[4].DistMin = 0.1*a;
Field[4].SizeMax = size/4;
Field[4].DistMax = size;
Field[5] = Min;
Field[5].FieldsList = {2, 4};
Background Field = 5;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
