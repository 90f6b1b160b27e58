"""The bonded pile of cases/bonded_pile in OpenGeoSys, its soil by a behaviour of MFront's generic interface.

    opengeosys.py PROGRAM FOLDER ANALYSIS TOLERANCE LAW [LIBRARY BEHAVIOUR]

ANALYSIS: axisymmetric or plane_strain; LAW: mohr_coulomb or elastic; without a library the program's own. TOLERANCE:
of the criterion |Δx|/|x|. Prints JSON: head force (compression positive, N; in plane strain N/mm), iterations, stress
11 22 33 12 by integration point with its position. Writes into the folder. Needs nothing but Python."""

import base64
import json
import pathlib
import re
import struct
import subprocess
import sys
from array import array

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "host" / "benches"))

import opengeosys as bench
from chamber import INCREMENTS, MESHES, PRESSURE, SOIL, Mesh

GAUSS = [(-0.6**0.5, 5 / 9), (0.0, 8 / 9), (0.6**0.5, 5 / 9)]


def replaced(text, old, new):
    if old not in text:
        sys.exit(f"the project has no {old}")
    return text.replace(old, new)


def project(mesh, analysis, tolerance, law, library, behaviour):
    """The bench's project, with another law of the soil, analysis and output."""
    text = bench.project(mesh, False)
    if library:
        start = text.index('<constitutive_relation id="0">')
        end = text.index("</constitutive_relation>", start)
        names = [name for name, ours in bench.MFRONT.items()
                 if ours in (SOIL if law == "mohr_coulomb" else ("young_modulus", "poisson_ratio"))]
        properties = "".join(f'<material_property name="{name}" parameter="soil_{bench.MFRONT[name]}"/>'
                             for name in names)
        text = (f'{text[:start]}<constitutive_relation id="0"><type>MFront</type><behaviour>{behaviour}</behaviour>'
                f"<library>{library}</library><material_properties>{properties}</material_properties>{text[end:]}")
    if analysis == "plane_strain":
        text = replaced(text, 'axially_symmetric="true"', 'axially_symmetric="false"')
    text = replaced(text, "<reltol>1e-7</reltol>", f"<reltol>{tolerance}</reltol>")
    # No names: everything is written, stresses at integration points among it.
    return replaced(text, "<variables><variable>NodalForces</variable></variables>", "<variables/>")


def values(text, name):
    """An array of a VTU file with inline base64."""
    found = re.search(rf'<DataArray[^>]*Name="{name}"[^>]*>\s*([A-Za-z0-9+/=]+)', text).group(1)
    size = struct.calcsize("<Q" if 'header_type="UInt64"' in text else "<I")
    start = -(-size // 3) * 4
    raw = base64.b64decode(found[start:]) if "=" in found[:start] else base64.b64decode(found)[size:]
    numbers = array("d")
    numbers.frombytes(raw[: len(raw) // 8 * 8])
    return numbers


def share_of_pressure(mesh, axisymmetric):
    """What the pressure on the soil adds to the head: they share a node. kN."""
    a, b = (mesh.nodes[node][0] for node in mesh.lines["top"][0][0][:2])
    at = [((a + b) / 2 + xi * (b - a) / 2, weight * (b - a) / 2 * xi * (xi - 1) / 2) for xi, weight in GAUSS]
    return PRESSURE * sum(weight * (2 * 3.141592653589793 * r if axisymmetric else 1.0) for r, weight in at)


def points(mesh, stress):
    """OpenGeoSys counts the points of an element along its second axis first."""
    rows = []
    for e, nodes in enumerate(mesh.elements):
        (x0, y0), (x1, y1) = mesh.nodes[nodes[0]], mesh.nodes[nodes[2]]
        for k in range(9):
            at = 4 * (9 * e + k)
            xi, eta = GAUSS[k // 3][0], GAUSS[k % 3][0]
            rows.append([(x0 + x1) / 2 + xi * (x1 - x0) / 2, (y0 + y1) / 2 + eta * (y1 - y0) / 2, *stress[at:at + 4]])
    return rows


def main():
    program, folder, analysis, tolerance, law, *own = sys.argv[1:]
    library, behaviour = own or (None, None)
    folder = pathlib.Path(folder)
    mesh = Mesh(*MESHES["m200"])
    bench.write(mesh, folder, False)
    (folder / "pile.prj").write_text(project(mesh, analysis, tolerance, law, library, behaviour))
    run = subprocess.run([program, "pile.prj", "-o", "."], cwd=folder, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"{program} failed\n{run.stdout[-2000:]}{run.stderr[-2000:]}")
    text = (folder / f"pile_{INCREMENTS}.vtu").read_text(errors="replace")
    forces = values(text, "NodalForces")
    head = sum(forces[2 * node + 1] for node in mesh.nodes_of("head"))
    share = share_of_pressure(mesh, analysis == "axisymmetric")
    print(json.dumps({
        "head_force": -1000.0 * (head + share),
        "iterations": bench.iterations(run.stdout + run.stderr),
        "points": points(mesh, values(text, "sigma_ip")),
    }))


main()
