// A roller bearing in the plane, its axis the origin: an inner ring, `rollers` rollers, an outer ring. Roller 1 is at the
// bottom, the others follow counterclockwise. Elements have the size 1/n on the arcs that may touch and
// grow into the bodies. Rollers have two more arcs, forwards and backwards, where the cage holds them.
SetFactory("OpenCASCADE");
DefineConstant[ rollers = {12, Name "rollers"} ];
DefineConstant[ clearance = {0.01, Name "clearance"} ]; // diametral; a quarter of it lies on either side of each roller
DefineConstant[ turn = {0, Name "turn"} ];              // how far roller 1 is from the bottom, in pitches
DefineConstant[ n = {8, Name "n"} ];                    // elements in 1 mm of the arcs that may touch

bore = 20;       // radius of the inner ring's bore
inner = 30;      // radius of the inner raceway
roller = 5;      // radius of the rollers
outer = inner + 2*roller + clearance/2;  // radius of the outer raceway
housing = 50;    // outside radius of the outer ring
wide = 0.75;     // half the length of the arcs where rings and rollers may touch
pocket = 1.5;    // and of those where the cage holds the rollers
pitch = inner + roller + clearance/4;    // radius of the circle through the axes of the rollers

Point(1) = {0, 0, 0};
race() = {inner, outer};
rest() = {bore, housing};

// The raceways, each as an arc beside every roller and one to the next roller.
For side In {0 : 1}
  r = race(side);
  half = 1.2*wide/r; // longer than those of the rollers, which are covered as a whole
  base = 10000*(side + 1);
  For k In {0 : rollers - 1}
    angle = (k + turn)*2*Pi/rollers - Pi/2;
    Point(base + 2*k) = {r*Cos(angle - half), r*Sin(angle - half), 0};
    Point(base + 2*k + 1) = {r*Cos(angle + half), r*Sin(angle + half), 0};
  EndFor
  For k In {0 : rollers - 1}
    next = (k + 1) % rollers;
    Circle(base + 2*k) = {base + 2*k, 1, base + 2*k + 1};
    Circle(base + 2*k + 1) = {base + 2*k + 1, 1, base + 2*next};
    Transfinite Curve {base + 2*k} = Round(2.4*wide*n) + 1;
  EndFor
  // The ring's other face in quarters, from the right.
  For q In {0 : 3}
    Point(base + 5000 + q) = {rest(side)*Cos(q*Pi/2), rest(side)*Sin(q*Pi/2), 0};
  EndFor
  For q In {0 : 3}
    Circle(base + 5000 + q) = {base + 5000 + q, 1, base + 5000 + (q + 1) % 4};
  EndFor
  Curve Loop(base) = {base : base + 2*rollers - 1};
  Curve Loop(base + 1) = {base + 5000 : base + 5003};
EndFor
Plane Surface(1) = {10000, 10001};
Plane Surface(2) = {20001, 20000};

// Rollers: arcs outwards, forwards, inwards, backwards, and what is between them.
half() = {wide/roller, pocket/roller, wide/roller, pocket/roller};
For k In {0 : rollers - 1}
  angle = (k + turn)*2*Pi/rollers - Pi/2;
  p = 100*(k + 1);
  x = pitch*Cos(angle);
  y = pitch*Sin(angle);
  Point(p) = {x, y, 0};
  For q In {0 : 3}
    to = angle + q*Pi/2;
    Point(p + 2*q + 1) = {x + roller*Cos(to - half(q)), y + roller*Sin(to - half(q)), 0};
    Point(p + 2*q + 2) = {x + roller*Cos(to + half(q)), y + roller*Sin(to + half(q)), 0};
  EndFor
  For q In {1 : 8}
    Circle(p + q) = {p + q, p, p + 1 + q % 8};
  EndFor
  Transfinite Curve {p + 1, p + 5} = Round(3*wide*n) + 1; // finer than the raceways: the pressure lives on the rollers
  Transfinite Curve {p + 3, p + 7} = 4;
  Curve Loop(p) = {p + 1 : p + 8};
  Plane Surface(p) = {p};
  Physical Surface(Sprintf("roller%g", k + 1)) = {p};
  Physical Curve(Sprintf("roller%g_cage", k + 1)) = {p + 3, p + 7};
EndFor

Physical Surface("inner") = {1};
Physical Surface("outer") = {2};
Physical Curve("bore") = {15000 : 15003};
Physical Curve("housing") = {25000 : 25003};

// Small where the rollers touch, a few elements across a ring elsewhere.
touched() = {};
For k In {0 : rollers - 1}
  touched() += {10000 + 2*k, 20000 + 2*k, 100*(k + 1) + 1, 100*(k + 1) + 5};
EndFor
Field[1] = Distance;
Field[1].CurvesList = {touched()};
Field[1].NumPointsPerCurve = 20;
Field[2] = Threshold;
Field[2].InField = 1;
Field[2].SizeMin = 1/n;
Field[2].DistMin = wide/2;
Field[2].SizeMax = 3;
Field[2].DistMax = 5;
Background Field = 2;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
