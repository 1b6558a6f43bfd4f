// A square b2 of side `size` on a block b1 of side one, at their common edge x = 0, and with `three` a block b3 on it. The blocks have
// elements of half that side at the edge, each row twice as large as the last.
DefineConstant[ size = {1e-4, Name "size"} ];
DefineConstant[ three = {0, Name "three"} ];
DefineConstant[ n = {3, Name "n"} ]; // elements along the square

rows = Ceil(Log(2/size + 1)/Log(2));
For body In {1 : 2 + three}
  p = newp;
  side = (body == 2) ? size : 1;
  low = (body == 1) ? -1 : ((body == 2) ? 0 : size);
  Point(p) = {0, low, 0};
  Point(p + 1) = {side, low, 0};
  Point(p + 2) = {side, low + side, 0};
  Point(p + 3) = {0, low + side, 0};
  l = newl;
  Line(l) = {p, p + 1};
  Line(l + 1) = {p + 1, p + 2};
  Line(l + 2) = {p + 2, p + 3};
  Line(l + 3) = {p + 3, p};
  If(body == 2)
    Transfinite Curve {l : l + 3} = n + 1;
  Else
    Transfinite Curve {l, -(l + 2)} = rows + 1 Using Progression 2;
    up = (body == 1) ? -1 : 1;
    Transfinite Curve {up*(l + 1), -up*(l + 3)} = rows + 1 Using Progression 2;
  EndIf
  c = newll;
  Curve Loop(c) = {l, l + 1, l + 2, l + 3};
  s = news;
  Plane Surface(s) = {c};
  Transfinite Surface {s} = {p, p + 1, p + 2, p + 3} Left;
  Physical Surface(Sprintf("b%g", body)) = {s};
  Physical Curve(Sprintf("b%g_bottom", body)) = {l};
  Physical Curve(Sprintf("b%g_right", body)) = {l + 1};
  Physical Curve(Sprintf("b%g_top", body)) = {l + 2};
  Physical Curve(Sprintf("b%g_left", body)) = {l + 3};
  Physical Point(Sprintf("b%g_pin", body)) = {p + 3};
EndFor
