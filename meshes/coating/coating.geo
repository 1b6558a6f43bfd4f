// A punch with a slightly crowned face on a coated block.
DefineConstant[ n = {8, Name "n"} ]; // elements along a unit of the block's top

Point(1) = {0, 0, 0};
Point(2) = {2, 0, 0};
Point(3) = {2, 1, 0};
Point(4) = {0, 1, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};

Point(11) = {0, 1, 0};
Point(12) = {1, 1, 0};
Point(13) = {1, 1.5, 0};
Point(14) = {0, 1.5, 0};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};

Transfinite Curve {1, 3} = 2*n + 1;
Transfinite Curve {2, 4} = n + 1;
Transfinite Curve {11, 13} = n + 1;
Transfinite Curve {12, 14} = n/2 + 1;
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Surface {1, 2};

Physical Surface("block") = {1};
Physical Surface("punch") = {2};
Physical Curve("block_bottom") = {1};
Physical Curve("block_top") = {3};
Physical Curve("block_axis") = {4};
Physical Curve("punch_bottom") = {11};
Physical Curve("punch_top") = {13};
Physical Curve("punch_axis") = {14};
