// A wall in running bond: `rows` courses of `columns` bricks 1 x 1/2, every other course between two half bricks. Nothing is shared, so that
// `between = "auto"` finds bed and head joints. Bricks are numbered course by course from the left; the ends, the first bed and the top have
// groups of their own.
DefineConstant[ rows = {8, Name "rows"} ];
DefineConstant[ columns = {8, Name "columns"} ];
DefineConstant[ n = {4, Name "n"} ]; // elements along a brick, half as many up
brick = 0;
For row In {0 : rows - 1}
  odd = row % 2;
  For place In {0 : columns - 1 + odd}
    x = (odd && place > 0) ? place - 0.5 : place;
    width = (odd && (place == 0 || place == columns)) ? 0.5 : 1;
    y = 0.5*row;
    p = 4*brick + 1;
    Point(p) = {x, y, 0};
    Point(p + 1) = {x + width, y, 0};
    Point(p + 2) = {x + width, y + 0.5, 0};
    Point(p + 3) = {x, y + 0.5, 0};
    Line(p) = {p, p + 1};
    Line(p + 1) = {p + 1, p + 2};
    Line(p + 2) = {p + 2, p + 3};
    Line(p + 3) = {p + 3, p};
    brick += 1;
    Transfinite Curve {p, p + 2} = Max(1, Round(n*width)) + 1;
    Transfinite Curve {p + 1, p + 3} = Max(1, Round(n/2)) + 1;
    Curve Loop(brick) = {p, p + 1, p + 2, p + 3};
    Plane Surface(brick) = {brick};
    Transfinite Surface {brick} = {p, p + 1, p + 2, p + 3} Left;
    Physical Surface(Sprintf("b%g", brick)) = {brick};
    If (row == 0)
      Physical Curve(Sprintf("b%g_bottom", brick)) = {p};
    EndIf
    If (place == columns - 1 + odd)
      Physical Curve(Sprintf("b%g_right", brick)) = {p + 1};
    EndIf
    If (row == rows - 1)
      Physical Curve(Sprintf("b%g_top", brick)) = {p + 2};
    EndIf
    If (place == 0)
      Physical Curve(Sprintf("b%g_left", brick)) = {p + 3};
    EndIf
  EndFor
EndFor
