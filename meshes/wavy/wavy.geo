// Half a wavelength of two blocks of height 1, one on the other; the upper mesh mirrors the lower one about y = 1.
DefineConstant[ L = {2, Name "L"} ];  // wavelength
DefineConstant[ n = {32, Name "n"} ]; // elements along half a wavelength; nearly square ones in height

width = L/2;
height = 1;
rows = Ceil(n*height/width);

Point(1) = {0, 0, 0};
Point(2) = {width, 0, 0};
Point(3) = {width, height, 0};
Point(4) = {0, height, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};

// The mirror image about y = height, with nothing shared.
Point(11) = {0, 2*height, 0};
Point(12) = {width, 2*height, 0};
Point(13) = {width, height, 0};
Point(14) = {0, height, 0};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};

Transfinite Curve {1, 3, 11, 13} = n + 1;
Transfinite Curve {2, 4, 12, 14} = rows + 1;
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Surface {1} = {1, 2, 3, 4} Left;
Transfinite Surface {2} = {11, 12, 13, 14} Left;

Physical Surface("lower") = {1};
Physical Surface("upper") = {2};
Physical Curve("lower_face") = {1};
Physical Curve("lower_sides") = {2, 4};
Physical Curve("lower_top") = {3};
Physical Curve("upper_face") = {11};
Physical Curve("upper_sides") = {12, 14};
Physical Curve("upper_bottom") = {13};
