// Bored pile of 0.8 m with a bell of 1.8 m, 12 m deep: half a section, r to the right, z up.
// gmsh -2 -format msh22 pile.geo makes pile.msh.
Mesh.ElementOrder = 2;
Mesh.SecondOrderIncomplete = 1;
near = 0.13; shaft = 0.7; far = 6;
Point(1) = {0, -30, 0, far};    Point(2) = {20, -30, 0, far};  Point(3) = {20, 0, 0, far};
Point(4) = {0.4, 0, 0, shaft};  Point(5) = {0, 0, 0, shaft};
Point(6) = {0.4, -10.6, 0, near}; Point(7) = {0.9, -11.6, 0, near};
Point(8) = {0.9, -12, 0, near}; Point(9) = {0, -12, 0, near};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4};
Line(4) = {4, 5}; Line(5) = {5, 9}; Line(6) = {9, 1};
Line(7) = {4, 6}; Line(8) = {6, 7}; Line(9) = {7, 8}; Line(10) = {9, 8};
Curve Loop(1) = {1, 2, 3, 7, 8, 9, -10, 6}; Plane Surface(1) = {1};
Curve Loop(2) = {7, 8, 9, -10, -5, -4};     Plane Surface(2) = {2};
Physical Surface("clay") = {1};
Physical Surface("pile") = {2};
Physical Curve("axis") = {5, 6};
Physical Curve("far") = {2};
Physical Curve("bottom") = {1};
Physical Curve("surface") = {3};
Physical Curve("head") = {4};
Physical Curve("shaft") = {7};
Physical Curve("bell") = {8, 9};
Physical Curve("base") = {10};
