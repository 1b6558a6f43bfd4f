// A half-space as a body of revolution: a cylinder of radius and height R, with elements of 1/n where contact has the radius 1.
DefineConstant[ n = {12, Name "n"}, R = {20, Name "R"} ];
Point(1) = {0, 0, 0, 1/n};
Point(2) = {1.4, 0, 0, 1/n};
Point(3) = {R, 0, 0, R/6};
Point(4) = {R, -R, 0, R/6};
Point(5) = {0, -R, 0, R/6};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Curve Loop(1) = {5, 4, 3, 2, 1};
Plane Surface(1) = {-1};
Physical Surface("block") = {1};
Physical Curve("top") = {1};
Physical Curve("base") = {4};
