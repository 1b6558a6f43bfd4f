// A quarter of a ring, 1/2 < r < 1, in a quarter of a ring, 1 < r < 3/2, with n and 3n/2 elements along the contact.
DefineConstant[ n = {8, Name "n"} ]; // a multiple of 4

Point(1) = {0, 0, 0};
Point(2) = {0.5, 0, 0};
Point(3) = {1, 0, 0};
Point(4) = {0, 1, 0};
Point(5) = {0, 0.5, 0};
Line(1) = {2, 3};
Circle(2) = {3, 1, 4};
Line(3) = {4, 5};
Circle(4) = {5, 1, 2};

// Nothing is shared.
Point(12) = {1, 0, 0};
Point(13) = {1.5, 0, 0};
Point(14) = {0, 1.5, 0};
Point(15) = {0, 1, 0};
Line(11) = {12, 13};
Circle(12) = {13, 1, 14};
Line(13) = {14, 15};
Circle(14) = {15, 1, 12};

Transfinite Curve {2, 4} = n + 1;
Transfinite Curve {1, 3} = n/2 + 1;
Transfinite Curve {12, 14} = 3*n/2 + 1;
Transfinite Curve {11, 13} = n/2 + 1;
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Surface {1} = {2, 3, 4, 5} Left;
Transfinite Surface {2} = {12, 13, 14, 15} Right;

Physical Surface("inner") = {1};
Physical Surface("outer") = {2};
Physical Curve("inner_x") = {1};
Physical Curve("inner_top") = {2};
Physical Curve("inner_y") = {3};
Physical Curve("inner_face") = {4};
Physical Curve("outer_x") = {11};
Physical Curve("outer_face") = {12};
Physical Curve("outer_y") = {13};
Physical Curve("outer_bottom") = {14};
