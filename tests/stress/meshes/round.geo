// A block b1 and a body b2 on it whose lower surface is a circle of radius R that touches the block at the origin; with `lens` its upper
// surface is one, too, and a block b3 lies on that. Half of it (x >= 0) or the `whole`; with a `depth` in space.
DefineConstant[ R = {2, Name "R"} ];
DefineConstant[ whole = {0, Name "whole"} ];
DefineConstant[ lens = {0, Name "lens"} ];
DefineConstant[ depth = {0, Name "depth"} ];
If(depth > 0)
  SetFactory("OpenCASCADE"); // extrusions share nothing
EndIf
DefineConstant[ n1 = {4, Name "n1"} ]; // elements along the half width 1 of b1
DefineConstant[ n2 = {4, Name "n2"} ];
DefineConstant[ n3 = {4, Name "n3"} ];

sag = R - Sqrt(R^2 - 1);
lift = (depth > 0) ? 0.01 : 0; // extrusions must not share points, or elements are lost: bodies are so far apart
rise = 1 + 2*sag + lift;       // of the lens

For body In {1 : 2 + lens}
  p = newp;
  n = (body == 1) ? n1 : ((body == 2) ? n2 : n3);
  along = whole ? 2*n : n;
  wide = (body == 2) ? 1 : 1.25;
  low = (body == 1) ? -1 : ((body == 2) ? sag + lift : rise + lift);
  high = (body == 1) ? 0 : ((body == 2) ? 1 + sag + lift : rise + lift + 1);
  left = whole ? -wide : 0;
  Point(p) = {left, (body == 2 && !whole) ? lift : low, 0};
  Point(p + 1) = {wide, low, 0};
  Point(p + 2) = {wide, high, 0};
  Point(p + 3) = {left, (body == 2 && lens && !whole) ? rise : high, 0};
  l = newl;
  If(body == 2)
    Point(p + 4) = {0, lift + R, 0};
    Point(p + 5) = {0, rise - R, 0};
    Circle(l) = {p, p + 4, p + 1};
  Else
    Line(l) = {p, p + 1};
  EndIf
  Line(l + 1) = {p + 1, p + 2};
  If(body == 2 && lens)
    Circle(l + 2) = {p + 2, p + 5, p + 3};
  Else
    Line(l + 2) = {p + 2, p + 3};
  EndIf
  Line(l + 3) = {p + 3, p};
  Transfinite Curve {l, l + 2} = along + 1;
  Transfinite Curve {l + 1, l + 3} = n + 1;
  c = newll;
  Curve Loop(c) = {l, l + 1, l + 2, l + 3};
  s = news;
  Plane Surface(s) = {c};
  Transfinite Surface {s} = {p, p + 1, p + 2, p + 3} Left;
  If(depth > 0)
    out() = Extrude {0, 0, depth} { Surface{s}; Layers{Max(1, Round(n/2))}; };
    Physical Volume(Sprintf("b%g", body)) = {out(1)};
    Physical Surface(Sprintf("b%g_front", body)) = {s};
    Physical Surface(Sprintf("b%g_back", body)) = {out(0)};
    // the kernel turns faces as it likes
    For i In {2 : 5}
      box() = BoundingBox Surface{out(i)};
      flat = box(3) - box(0) > 1e-3;
      If(flat && box(1) + box(4) < low + high)
        Physical Surface(Sprintf("b%g_bottom", body)) = {out(i)};
      ElseIf(flat)
        Physical Surface(Sprintf("b%g_top", body)) = {out(i)};
      ElseIf(box(0) < 0.5)
        Physical Surface(Sprintf("b%g_left", body)) = {out(i)};
      Else
        Physical Surface(Sprintf("b%g_right", body)) = {out(i)};
      EndIf
    EndFor
  Else
    Physical Surface(Sprintf("b%g", body)) = {s};
    Physical Curve(Sprintf("b%g_bottom", body)) = {l};
    Physical Curve(Sprintf("b%g_right", body)) = {l + 1};
    Physical Curve(Sprintf("b%g_top", body)) = {l + 2};
    Physical Curve(Sprintf("b%g_left", body)) = {l + 3};
  EndIf
  Physical Point(Sprintf("b%g_pin", body)) = {p + 3};
  Physical Point(Sprintf("b%g_spin", body)) = {p + 2};
EndFor
