// A wall in running bond: `rows` courses of `columns` bricks, numbered course by course from the left below. Joints of even courses lie
// over the middles of bricks: there the first brick is half as long and the last one half as long again. Nothing is shared.
DefineConstant[ columns = {8, Name "columns"} ]; // bricks in a course
DefineConstant[ rows = {8, Name "rows"} ];       // courses
DefineConstant[ length = {0.25, Name "length"} ];
DefineConstant[ height = {0.125, Name "height"} ];
DefineConstant[ n = {4, Name "n"} ];             // elements along a brick, half as many over its height

parity() = Str("even", "odd");
bottom() = {}; top() = {}; left() = {}; right() = {};
For row In {1 : rows}
  For column In {1 : columns}
    brick = (row - 1)*columns + column;
    c = 4*(brick - 1); // corners and sides: below, right, above, left
    shift = (row % 2 == 1 || columns == 1) ? 0 : 0.5;
    from = (column == 1) ? 0 : column - 1 - shift;
    to = (column == columns) ? columns : column - shift;
    y = (row - 1)*height;
    Point(c + 1) = {from*length, y, 0};
    Point(c + 2) = {to*length, y, 0};
    Point(c + 3) = {to*length, y + height, 0};
    Point(c + 4) = {from*length, y + height, 0};
    For side In {1 : 4}
      Line(c + side) = {c + side, c + side % 4 + 1};
    EndFor
    Transfinite Curve {c + 1, c + 3} = Max(1, Round(n*(to - from))) + 1;
    Transfinite Curve {c + 2, c + 4} = Max(1, Round(n/2)) + 1;
    Curve Loop(brick) = {c + 1 : c + 4};
    Plane Surface(brick) = {brick};
    Transfinite Surface {brick} Alternate;
    Physical Surface(Sprintf(StrCat("brick_", parity(row % 2), "_%g"), brick)) = {brick};
    If (row == 1)
      bottom() += c + 1;
    EndIf
    If (row == rows)
      top() += c + 3;
    EndIf
    If (column == 1)
      left() += c + 4;
    EndIf
    If (column == columns)
      right() += c + 2;
    EndIf
  EndFor
EndFor
Physical Curve("bottom") = {bottom()};
Physical Curve("top") = {top()};
Physical Curve("left") = {left()};
Physical Curve("right") = {right()};
