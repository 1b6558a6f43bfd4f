// Two spheres of radius R that touch at the origin, each cut to a block of side `size` around the contact; x = 0 and y = 0 are
// planes of symmetry, so a quarter is left. Elements of size a/n around the contact, smaller at its edge, growing outwards.
SetFactory("OpenCASCADE");
DefineConstant[ n = {4, Name "n"} ];  // elements along the radius a = 1 that the contact has under the load of the scene
DefineConstant[ edge = {1, Name "edge"} ]; // how many times smaller they are where that contact ends
DefineConstant[ R = {50, Name "R"} ];

a = 1;
size = 20;    // of the blocks: far enough from the contact
wide = 2.5*a; // radius of the surfaces that may touch
e = 1e-3;

up() = {-1, 1}; // from the contact to the axis of the sphere
For s In {0 : 1}
  v = 10*(s + 1);
  Sphere(v) = {0, 0, up(s)*R, R};
  Box(v + 1) = {0, 0, Min(0, up(s)*size), size, size, size};
  BooleanIntersection(v + 2) = { Volume{v}; Delete; }{ Volume{v + 1}; Delete; };
  // A small ball around the contact parts its surface from the rest of the sphere.
  Sphere(v + 3) = {0, 0, 0, wide};
  core() = BooleanIntersection{ Volume{v + 2}; }{ Volume{v + 3}; Delete; };
  BooleanFragments{ Volume{v + 2}; Delete; }{ Volume{core()}; Delete; }
EndFor

low() = Volume In BoundingBox{-e, -e, -size - e, 2*size, 2*size, e}; // Gmsh finds curved faces larger than they are
high() = Volume In BoundingBox{-e, -e, -e, 2*size, 2*size, size + e};
Physical Volume("lower") = {low()};
Physical Volume("upper") = {high()};
Physical Surface("lower_top") = {Surface In BoundingBox{-e, -e, -wide/5, wide + e, wide + e, e}};
Physical Surface("upper_bottom") = {Surface In BoundingBox{-e, -e, -e, wide + e, wide + e, wide/5}};
Physical Surface("lower_face") = {Surface In BoundingBox{-e, -e, -size - e, size + e, size + e, -size + e}};
Physical Surface("upper_face") = {Surface In BoundingBox{-e, -e, size - e, size + e, size + e, size + e}};
Physical Surface("lower_x") = {Surface In BoundingBox{-e, -e, -size - e, e, size + e, e}}; // x = 0
Physical Surface("upper_x") = {Surface In BoundingBox{-e, -e, -e, e, size + e, size + e}};
Physical Surface("lower_y") = {Surface In BoundingBox{-e, -e, -size - e, size + e, e, e}}; // y = 0
Physical Surface("upper_y") = {Surface In BoundingBox{-e, -e, -e, size + e, e, size + e}};

Field[1] = Distance;
Field[1].PointsList = {Point In BoundingBox{-e, -e, -e, e, e, e}};
Field[2] = Threshold;
Field[2].InField = 1;
Field[2].SizeMin = a/n;
Field[2].DistMin = 1.2*a;
Field[2].SizeMax = size/4;
Field[2].DistMax = size;
Field[3] = MathEval; // distance from the circle of radius a
Field[3].F = Sprintf("Sqrt((Sqrt(x^2 + y^2) - %g)^2 + z^2)", a);
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
