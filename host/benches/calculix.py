"""The elastic bonded pile for CalculiX, and its answer."""

import re

from chamber import PILE, PUSH, SOIL


def write(mesh, folder):
    """`pile.inp`: elements CAX8, the head's displacement in one step, the head's force as result."""
    with open(folder / "pile.inp", "w") as file:
        def rows(header, values):
            file.write(header + "\n")
            file.writelines(",".join(map(str, row)) + "\n" for row in values)

        rows("*NODE,NSET=ALL", ((i + 1, f"{r:.15g}", f"{z:.15g}") for i, (r, z) in enumerate(mesh.nodes)))
        for name, in_pile in (("SOIL", False), ("PILE", True)):
            numbered = zip(mesh.elements, mesh.in_pile)
            rows(f"*ELEMENT,TYPE=CAX8,ELSET={name}",
                 ((e + 1, *(n + 1 for n in nodes)) for e, (nodes, pile) in enumerate(numbered)
                  if pile == in_pile))
        for line in ("axis", "wall", "bottom", "head"):
            rows(f"*NSET,NSET={line.upper()}", ((n + 1,) for n in mesh.nodes_of(line)))
        for name, of in (("SOIL", SOIL), ("PILE", PILE)):
            rows(f"*MATERIAL,NAME={name}\n*ELASTIC", [(of["young_modulus"], of["poisson_ratio"])])
            file.write(f"*SOLID SECTION,ELSET={name},MATERIAL={name}\n")
        rows("*BOUNDARY", [("AXIS", 1, 1), ("WALL", 1, 1), ("BOTTOM", 2, 2)])
        file.write("*STEP\n*STATIC,SOLVER=SPOOLES\n")
        rows("*BOUNDARY", [("HEAD", 2, 2, -PUSH)])
        file.write("*NODE PRINT,NSET=HEAD,TOTALS=ONLY\nRF\n*END STEP\n")


def head_force(folder):
    """Compression positive, N. CalculiX takes a wedge of 2 degrees and prints 7 digits."""
    text = (folder / "pile.dat").read_text()
    found = re.search(r"total force.*?\n\s*\S+\s+(\S+)", text, re.DOTALL)
    return -180.0 * 1000.0 * float(found.group(1))
