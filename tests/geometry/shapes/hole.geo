// A plate with a round hole on a larger plate: curved edges in a plane, and facets of another size beside them.
SetFactory("OpenCASCADE");
Box(1) = {-6, -6, 0, 12, 12, 3};
Cylinder(2) = {0, 0, 0, 0, 0, 3, 3};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Box(4) = {-8, -8, -3.01, 16, 16, 3};
Physical Volume("foot") = {3};
Physical Volume("plate") = {4};
e = 1e-3;
f() = Surface In BoundingBox {-6-e, -6-e, -e, 6+e, 6+e, e};
Physical Surface("foot_bottom") = {f(0)};
t() = Surface In BoundingBox {-6-e, -6-e, 3-e, 6+e, 6+e, 3+e};
Physical Surface("foot_top") = {t(0)};
p() = Surface In BoundingBox {-8-e, -8-e, -0.01-e, 8+e, 8+e, -0.01+e};
Physical Surface("plate_top") = {p()};
b() = Surface In BoundingBox {-8-e, -8-e, -3.01-e, 8+e, 8+e, -3.01+e};
Physical Surface("plate_bottom") = {b()};
Mesh.MeshSizeMax = 4;
MeshSize { PointsOf{ Volume{4}; } } = 5;
