// Two unit cubes, one on the other with nothing shared, n elements along each edge of the lower one and 3n/2 of the upper one.
SetFactory("OpenCASCADE");
DefineConstant[ n = {4, Name "n"} ]; // even

// A box has 8 points, 12 lines and the faces x0 x1 y0 y1 z0 z1.
Box(1) = {0, 0, 0, 1, 1, 1};
Box(2) = {0, 0, 1, 1, 1, 1};
Transfinite Curve {1:12} = n + 1;
Transfinite Curve {13:24} = 3*n/2 + 1;
Transfinite Surface {1:12};
Transfinite Volume {1, 2};

Physical Volume("lower") = {1};
Physical Surface("lower_x0") = {1};
Physical Surface("lower_x1") = {2};
Physical Surface("lower_y0") = {3};
Physical Surface("lower_y1") = {4};
Physical Surface("lower_bottom") = {5};
Physical Surface("lower_top") = {6};
Physical Volume("upper") = {2};
Physical Surface("upper_x0") = {7};
Physical Surface("upper_x1") = {8};
Physical Surface("upper_y0") = {9};
Physical Surface("upper_y1") = {10};
Physical Surface("upper_bottom") = {11};
Physical Surface("upper_top") = {12};
