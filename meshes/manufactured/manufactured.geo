// Two unit squares, one on the other, with n elements along each side of the lower one and 3n/2 of the upper one.
DefineConstant[ n = {8, Name "n"} ]; // even

Point(1) = {0, 0, 0};
Point(2) = {1, 0, 0};
Point(3) = {1, 1, 0};
Point(4) = {0, 1, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};

// Nothing is shared.
Point(11) = {0, 1, 0};
Point(12) = {1, 1, 0};
Point(13) = {1, 2, 0};
Point(14) = {0, 2, 0};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};

Transfinite Curve {1, 2, 3, 4} = n + 1;
Transfinite Curve {11, 12, 13, 14} = 3*n/2 + 1;
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Surface {1} = {1, 2, 3, 4} Left;
Transfinite Surface {2} = {11, 12, 13, 14} Right;

Physical Surface("lower") = {1};
Physical Surface("upper") = {2};
Physical Curve("lower_face") = {1};
Physical Curve("lower_right") = {2};
Physical Curve("lower_top") = {3};
Physical Curve("lower_left") = {4};
Physical Curve("upper_bottom") = {11};
Physical Curve("upper_right") = {12};
Physical Curve("upper_face") = {13};
Physical Curve("upper_left") = {14};
