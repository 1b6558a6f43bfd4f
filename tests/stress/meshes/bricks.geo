// A wall of `courses` of `bricks` 1 x 1/2 each; every other course begins and ends with half a brick. Nothing is shared. Bricks are
// numbered course by course from the left.
DefineConstant[ courses = {3, Name "courses"} ];
DefineConstant[ bricks = {2, Name "bricks"} ];
DefineConstant[ n1 = {2, Name "n1"} ]; // elements along every other brick
DefineConstant[ n2 = {2, Name "n2"} ];

brick = 0;
For course In {0 : courses - 1}
  odd = course % 2;
  For place In {0 : bricks - 1 + odd}
    x = (odd && place > 0) ? place - 0.5 : place;
    width = (odd && (place == 0 || place == bricks)) ? 0.5 : 1;
    n = (brick % 2) ? n2 : n1;
    brick += 1;
    p = newp;
    y = 0.5*course;
    Point(p) = {x, y, 0};
    Point(p + 1) = {x + width, y, 0};
    Point(p + 2) = {x + width, y + 0.5, 0};
    Point(p + 3) = {x, y + 0.5, 0};
    l = newl;
    Line(l) = {p, p + 1};
    Line(l + 1) = {p + 1, p + 2};
    Line(l + 2) = {p + 2, p + 3};
    Line(l + 3) = {p + 3, p};
    Transfinite Curve {l, l + 2} = Max(1, Round(n*width)) + 1;
    Transfinite Curve {l + 1, l + 3} = Max(1, Round(n/2)) + 1;
    c = newll;
    Curve Loop(c) = {l, l + 1, l + 2, l + 3};
    s = news;
    Plane Surface(s) = {c};
    Transfinite Surface {s} = {p, p + 1, p + 2, p + 3} Left;
    Physical Surface(Sprintf("b%g", brick)) = {s};
    Physical Curve(Sprintf("b%g_bottom", brick)) = {l};
    Physical Curve(Sprintf("b%g_right", brick)) = {l + 1};
    Physical Curve(Sprintf("b%g_top", brick)) = {l + 2};
    Physical Curve(Sprintf("b%g_left", brick)) = {l + 3};
    Physical Point(Sprintf("b%g_pin", brick)) = {p + 3};
  EndFor
EndFor
