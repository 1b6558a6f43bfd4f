// A quarter of a pipe joint with 8 bolts: two flanges with a neck, one on the other at z = 0, between the planes of symmetry
// x = 0 and y = 0. Two bolts lie in the quarter. Elements are small around the bolts and grow to the neck.
SetFactory("OpenCASCADE");
DefineConstant[ n = {2, Name "n"} ];         // elements through the thickness of a flange
DefineConstant[ thick = {16, Name "thick"} ]; // thickness of a flange

pipe = 50;     // inner radius of the pipe
wall = 7;      // thickness of its wall
neck = 24;     // length of the piece of pipe above the flange
rim = 110;     // outer radius of the flanges
bolts = 86;    // radius of the circle on which the bolts are
hole = 8;      // radius of a bolt's hole
washer = 15;   // radius of a washer
e = 1e-3;

up() = {-1, 1};
joint() = {0, 0};
For s In {0 : 1}
  v = 20*(s + 1);
  z = Min(0, up(s)*thick);
  top = Min(0, up(s)*(thick + neck));
  Cylinder(v) = {0, 0, z, 0, 0, thick, rim, Pi/2};
  Cylinder(v + 1) = {0, 0, top, 0, 0, thick + neck, pipe + wall, Pi/2};
  BooleanUnion(v + 2) = { Volume{v}; Delete; }{ Volume{v + 1}; Delete; };
  Cylinder(v + 3) = {0, 0, top, 0, 0, thick + neck, pipe, Pi/2};
  For b In {0 : 1}
    angle = Pi/8 + b*Pi/4;
    Cylinder(v + 4 + b) = {bolts*Cos(angle), bolts*Sin(angle), z, 0, 0, thick, hole};
  EndFor
  BooleanDifference(v + 6) = { Volume{v + 2}; Delete; }{ Volume{v + 3 : v + 5}; Delete; };
  For b In {0 : 1}
    angle = Pi/8 + b*Pi/4;
    d = 1000*(s + 1) + 10*b;
    Disk(d) = {bolts*Cos(angle), bolts*Sin(angle), up(s)*thick, washer};
    Disk(d + 1) = {bolts*Cos(angle), bolts*Sin(angle), up(s)*thick, hole};
    BooleanDifference(d + 2) = { Surface{d}; Delete; }{ Surface{d + 1}; Delete; };
  EndFor
  BooleanFragments{ Volume{v + 6}; Delete; }{ Surface{1000*(s + 1) + 2, 1000*(s + 1) + 12}; Delete; }
  // The faces of both flanges lie in the same place: of those there now, the last one is new.
  faces() = Surface In BoundingBox{-e, -e, -e, rim + e, rim + e, e};
  joint(s) = faces(#faces() - 1);
EndFor

far = 2*rim; // Gmsh finds curved faces larger than they are
Physical Volume("lower") = {Volume In BoundingBox{-e, -e, -far, far, far, e}};
Physical Volume("upper") = {Volume In BoundingBox{-e, -e, -e, far, far, far}};
Physical Surface("lower_joint") = {joint(0)};
Physical Surface("upper_joint") = {joint(1)};
Physical Surface("lower_x") = {Surface In BoundingBox{-e, -e, -far, e, far, e}}; // x = 0
Physical Surface("upper_x") = {Surface In BoundingBox{-e, -e, -e, e, far, far}};
Physical Surface("lower_y") = {Surface In BoundingBox{-e, -e, -far, far, e, e}}; // y = 0
Physical Surface("upper_y") = {Surface In BoundingBox{-e, -e, -e, far, e, far}};
Physical Surface("lower_end") = {Surface In BoundingBox{-e, -e, -thick - neck - e, far, far, -thick - neck + e}};
Physical Surface("upper_end") = {Surface In BoundingBox{-e, -e, thick + neck - e, far, far, thick + neck + e}};
Physical Surface("lower_bore") = {Surface In BoundingBox{-e, -e, -thick - neck - e, pipe + e, pipe + e, e}};
Physical Surface("upper_bore") = {Surface In BoundingBox{-e, -e, -e, pipe + e, pipe + e, thick + neck + e}};
For s In {0 : 1}
  washers() = {};
  For b In {0 : 1}
    x = bolts*Cos(Pi/8 + b*Pi/4);
    y = bolts*Sin(Pi/8 + b*Pi/4);
    z = up(s)*thick;
    washers() += Surface In BoundingBox{x - washer - e, y - washer - e, z - e, x + washer + e, y + washer + e, z + e};
  EndFor
  If (s == 0)
    Physical Surface("lower_washers") = {washers()};
  Else
    Physical Surface("upper_washers") = {washers()};
  EndIf
EndFor

// Small around the bolts, larger towards the ends.
Field[1] = MathEval;
Field[1].F = Sprintf("%g + 0.15*Abs(z)", thick/n);
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 12; // elements around a hole
