// Two blocks 16 x 16 that stand for half-planes; the axis of a groove of half-width 1 is x = 16. Elements of size 1/n
// along the contact to twice that half-width, then growing to about 1 outwards and in depth. The upper mesh mirrors the
// lower one about y = 16.
DefineConstant[ n = {64, Name "n"} ]; // elements along the half-width of the groove, at least 2

size = 16;
fine = 2;

// Geometric growth from 1/n to 1 over a length: ratio and number of elements.
ratio_out = (size - fine - 1/n)/(size - fine - 1);
count_out = Round(1 + Log(n)/Log(ratio_out));
ratio_deep = (size - 1/n)/(size - 1);
count_deep = Round(1 + Log(n)/Log(ratio_deep));

Point(1) = {0, 0, 0};
Point(2) = {size - fine, 0, 0};
Point(3) = {size, 0, 0};
Point(4) = {size, size, 0};
Point(5) = {size - fine, size, 0};
Point(6) = {0, size, 0};
Line(1) = {2, 1};
Line(2) = {2, 3};
Line(3) = {4, 3};
Line(4) = {5, 4};
Line(5) = {5, 6};
Line(6) = {6, 1};

// The mirror image about y = size, with nothing shared.
Point(11) = {0, 2*size, 0};
Point(12) = {size - fine, 2*size, 0};
Point(13) = {size, 2*size, 0};
Point(14) = {size, size, 0};
Point(15) = {size - fine, size, 0};
Point(16) = {0, size, 0};
Line(11) = {12, 11};
Line(12) = {12, 13};
Line(13) = {14, 13};
Line(14) = {15, 14};
Line(15) = {15, 16};
Line(16) = {16, 11};

Transfinite Curve {1, 5, 11, 15} = count_out + 1 Using Progression ratio_out;
Transfinite Curve {2, 4, 12, 14} = fine*n + 1;
Transfinite Curve {3, 6, 13, 16} = count_deep + 1 Using Progression ratio_deep;
Curve Loop(1) = {-1, 2, -3, -4, 5, 6};
Curve Loop(2) = {-11, 12, -13, -14, 15, 16};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Surface {1} = {1, 3, 4, 6} Left;
Transfinite Surface {2} = {11, 13, 14, 16} Left;

Physical Surface("lower") = {1};
Physical Surface("upper") = {2};
Physical Curve("lower_face") = {1, 2};
Physical Curve("lower_axis") = {3};
Physical Curve("lower_top") = {4, 5};
Physical Curve("upper_face") = {11, 12};
Physical Curve("upper_axis") = {13};
Physical Curve("upper_bottom") = {14, 15};
Physical Point("lower_pin") = {6};
Physical Point("upper_pin") = {16};
