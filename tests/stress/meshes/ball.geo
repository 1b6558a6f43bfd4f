// A quarter of a sphere of radius R > 1.5, cut to a block, on a quarter of a block: x = 0 and y = 0 are planes of symmetry, z is up.
SetFactory("OpenCASCADE");
DefineConstant[ R = {3, Name "R"} ];
DefineConstant[ n1 = {2, Name "n1"} ]; // elements along the edge 1 of the block b1
DefineConstant[ n2 = {2, Name "n2"} ];

e = 1e-4;
Box(1) = {0, 0, -1, 1.2, 1.2, 1};
Box(2) = {0, 0, 0, 1, 1, 1.5};
Sphere(3) = {0, 0, R, R};
BooleanIntersection{ Volume{2}; Delete; }{ Volume{3}; Delete; }
low() = Volume In BoundingBox{-e, -e, -1 - e, 2, 2, e};
high() = Volume In BoundingBox{-e, -e, -e, 2, 2, 2};
Physical Volume("b1") = {low()};
Physical Volume("b2") = {high()};
below() = Abs(Boundary{ Volume{low()}; });
above() = Abs(Boundary{ Volume{high()}; });
Physical Surface("b1_bottom") = {Surface In BoundingBox{-e, -e, -1 - e, 2, 2, -1 + e}};
Physical Surface("b1_top") = {Surface In BoundingBox{-e, -e, -e, 1.2 + e, 1.2 + e, e}};
Physical Surface("b1_left") = {Surface In BoundingBox{-e, -e, -1 - e, e, 2, e}};
Physical Surface("b1_front") = {Surface In BoundingBox{-e, -e, -1 - e, 2, e, e}};
Physical Surface("b2_top") = {Surface In BoundingBox{-e, -e, 1.5 - e, 2, 2, 1.5 + e}};
Physical Surface("b2_left") = {Surface In BoundingBox{-e, -e, -e, e, 2, 1.5 + e}};
Physical Surface("b2_front") = {Surface In BoundingBox{-e, -e, -e, 2, e, 1.5 + e}};
Physical Surface("b2_bottom") = {above()};
Physical Surface("b2_bottom") -= {Surface In BoundingBox{-e, -e, 1.5 - e, 2, 2, 1.5 + e}};
Physical Surface("b2_bottom") -= {Surface In BoundingBox{-e, -e, -e, e, 2, 1.5 + e}};
Physical Surface("b2_bottom") -= {Surface In BoundingBox{-e, -e, -e, 2, e, 1.5 + e}};
Physical Surface("b2_bottom") -= {Surface In BoundingBox{1 - e, -e, -e, 1 + e, 2, 1.5 + e}};
Physical Surface("b2_bottom") -= {Surface In BoundingBox{-e, 1 - e, -e, 2, 1 + e, 1.5 + e}};
MeshSize{ PointsOf{ Volume{low()}; } } = 1.2/n1;
MeshSize{ PointsOf{ Volume{high()}; } } = 1/n2;
