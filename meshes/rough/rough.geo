// Two boxes with a square face of side 1, one on the other with nothing shared, elements as fine as the face wants them and
// longer away from it.
SetFactory("OpenCASCADE");
DefineConstant[ n = {16, Name "n"} ];           // elements along each edge of the lower face
DefineConstant[ m = {n, Name "m"} ];            // the same of the upper box
DefineConstant[ height = {0.5, Name "height"} ]; // of each box
DefineConstant[ layers = {6, Name "layers"} ];  // elements along it
DefineConstant[ growth = {1.5, Name "growth"} ]; // of their heights

Box(1) = {0, 0, -height, 1, 1, height};
Box(2) = {0, 0, 0, 1, 1, height};
// vertical edges run upwards
Transfinite Curve {2, 4, 6, 8:12} = n + 1;
Transfinite Curve {14, 16, 18, 20:24} = m + 1;
Transfinite Curve {1, 3, 5, 7} = layers + 1 Using Progression 1/growth;
Transfinite Curve {13, 15, 17, 19} = layers + 1 Using Progression growth;
Transfinite Surface {1:12};
Transfinite Volume {1, 2};

Physical Volume("lower") = {1};
Physical Surface("lower_x") = {1, 2};
Physical Surface("lower_y") = {3, 4};
Physical Surface("lower_bottom") = {5};
Physical Surface("lower_top") = {6};
Physical Volume("upper") = {2};
Physical Surface("upper_x") = {7, 8};
Physical Surface("upper_y") = {9, 10};
Physical Surface("upper_bottom") = {11};
Physical Surface("upper_top") = {12};
