"""The meshes of the benches: the bonded pile of cases/bonded_pile and the chamber of
cases/chamber_mesh1, on any number of elements, as case files and, for other programs, as nodes and
elements. Units as in the cases: m, kN, kPa."""

from array import array

from programs import ROOT

CASES = ROOT / "cases"

SOIL = {"young_modulus": 34e3, "poisson_ratio": 0.3, "cohesion": 1.0,
        "friction_angle": 36.5, "dilatancy_angle": 12.0}
PILE = {"young_modulus": 210e6, "poisson_ratio": 0.28}
# Radius of pile and chamber, level of the pile's toe, height.
R_PILE, R, Z_TOE, H = 0.010, 0.262, 0.180, 0.680
# Columns and rows: those of the case, and a larger one.
MESHES = {"m200": (10, 20), "m2k": (32, 63), "m5k": (50, 100), "m20k": (100, 200), "m100k": (224, 448)}
PRESSURE, PUSH, INCREMENTS = 100.0, 0.0005, 10


def bonded_parts(columns, rows):
    """Columns and rows of the bonded pile as in its case: columns grow outward (12 : 1), rows
    shrink towards the toe from below (4 : 1)."""
    in_pile, below = columns // 10, rows // 4
    outside, beside = columns - in_pile, rows - below
    return ([(in_pile, R_PILE, 1.0), (outside, R, 12 ** (1 / (outside - 1)))],
            [(below, Z_TOE, 0.25 ** (1 / (below - 1))), (beside, H, 1.0)])


def toml_parts(parts):
    rows = (f"  {{ n = {n}, to = {to!r}, ratio = {ratio!r} }},\n" for n, to, ratio in parts)
    return f"[\n{''.join(rows)}]\n"


def bonded_case(columns, rows, elastic, increments=INCREMENTS):
    """The bonded pile on a mesh. Plastic: the first increments of the case. Elastic: all of them in
    one, without stress at its start, since some programs cannot have one."""
    x, z = bonded_parts(columns, rows)
    text = f'base = "{CASES}/bonded_pile/case.toml"\n'
    phase = '[[phase]]\nname = "push"\n'
    if elastic:
        none = "initial_stress = { 11 = 0.0, 22 = 0.0, 33 = 0.0, 12 = 0.0 }\n"
        text += f'[groups.soil]\nlaw = "elastic_soil"\n{none}[groups.pile]\n{none}'
        phase += "increments = 1\npressure = []\n"
    else:
        push = PUSH * increments / INCREMENTS
        phase += (f"increments = {increments}\n"
                  f'displacement = [{{ line = "pile_head", z = {-push!r} }}]\n')
    return text + phase + (f'[[variant]]\nname = "bench"\nmesh.columns = {toml_parts(x)}'
                           f"mesh.rows = {toml_parts(z)}")


def mepi_case(k, increments):
    """Mesh 1 with every element divided by k in both directions, the interface along its length
    only, loaded in this number of increments."""
    def finer(parts):
        return toml_parts([(k * n, to, ratio ** (1 / k)) for n, to, ratio in parts])

    x = toml_parts([(2 * k, 0.010, 1.0), (1, 0.012, 1.0), (7 * k, 0.262, 1.6 ** (1 / k))])
    z = finer([(1, 0.0, 1.0), (8, 0.180, 0.8), (10, 0.680, 1.0)])
    text = (f'base = "{CASES}/chamber_mesh1/case.toml"\n'
            f'[mesh]\ncolumns = {x}rows = {z}[groups.interface]\nnormal = "x"\n'
            '[output]\nprofile = "phases"\nfields = "never"\n')
    return text + f'[[phase]]\nname = "loading"\nincrements = {increments}\n'


class Mesh:
    """The bonded pile as nodes and 8-node elements, as other programs want them.

    `nodes`: coordinates. `elements`: corners counter-clockwise from the lower left, then the middles
    of the sides below, right, above, left. `in_pile` of every element. `lines`: for every name the
    edges (end, end, middle), left to right or upwards, and their elements.
    """

    def __init__(self, columns, rows):
        x, z = (self.halved(parts) for parts in bonded_parts(columns, rows))
        number, self.nodes = {}, []
        for j, at_z in enumerate(z):
            for i, at_x in enumerate(x):
                if i % 2 == 0 or j % 2 == 0:
                    number[i, j] = len(self.nodes)
                    self.nodes.append((at_x, at_z))
        around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        self.elements, self.in_pile = [], []
        for j in range(0, 2 * rows, 2):
            for i in range(0, 2 * columns, 2):
                self.elements.append([number[i + a, j + b] for a, b in around])
                self.in_pile.append(x[i + 1] < R_PILE and z[j + 1] > Z_TOE)

        def row(j, element_row, keep):
            return ([(number[i, j], number[i + 2, j], number[i + 1, j])
                     for i in range(0, 2 * columns, 2) if keep(x[i + 1])],
                    [element_row * columns + i // 2
                     for i in range(0, 2 * columns, 2) if keep(x[i + 1])])

        def column(i, element_column):
            return ([(number[i, j], number[i, j + 2], number[i, j + 1])
                     for j in range(0, 2 * rows, 2)],
                    [j // 2 * columns + element_column for j in range(0, 2 * rows, 2)])

        self.lines = {
            "axis": column(0, 0),
            "wall": column(2 * columns, columns - 1),
            "bottom": row(0, 0, lambda _: True),
            "head": row(2 * rows, rows - 1, lambda r: r < R_PILE),
            "top": row(2 * rows, rows - 1, lambda r: r > R_PILE),
        }

    @staticmethod
    def halved(parts):
        """Coordinates of element sides and of the middles between them."""
        at = [0.0]
        for n, to, ratio in parts:
            start, sizes = at[-1], [ratio**i for i in range(n)]
            reached = 0.0
            for size in sizes[:-1]:
                reached += size
                at.append(start + (to - start) * reached / sum(sizes))
            at.append(to)
        both = array("d", [at[0]])
        for a, b in zip(at, at[1:]):
            both.extend([(a + b) / 2, b])
        return both

    def nodes_of(self, line):
        return sorted({node for edge in self.lines[line][0] for node in edge})
