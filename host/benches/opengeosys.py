"""The bonded pile for OpenGeoSys, and its answer."""

import base64
import re
import struct
from array import array

from chamber import INCREMENTS, PILE, PRESSURE, PUSH, SOIL

VTK_QUADRATIC_EDGE, VTK_QUADRATIC_QUAD = 21, 23
TYPES = {"d": "Float64", "q": "Int64", "Q": "UInt64", "i": "Int32", "B": "UInt8"}


def write(mesh, folder, elastic):
    """`pile.prj` and its meshes."""
    flat = array("d", (c for r, z in mesh.nodes for c in (r, z, 0.0)))
    grid(folder / "bulk.vtu", flat, mesh.elements, VTK_QUADRATIC_QUAD,
         cells={"MaterialIDs": array("i", map(int, mesh.in_pile))})
    for name, (edges, elements) in mesh.lines.items():
        nodes = mesh.nodes_of(name)
        at = {node: i for i, node in enumerate(nodes)}
        some = array("d", (c for n in nodes for c in (*mesh.nodes[n], 0.0)))
        grid(folder / f"{name}.vtu", some, [[at[n] for n in edge] for edge in edges], VTK_QUADRATIC_EDGE,
             points={"bulk_node_ids": array("Q", nodes)}, cells={"bulk_element_ids": array("Q", elements)})
    (folder / "pile.prj").write_text(project(mesh, elastic))


def grid(path, coordinates, elements, kind, points=None, cells=None):
    """A VTU file, its arrays in base64."""
    def values(name, data, components=1):
        raw = data.tobytes()
        text = base64.b64encode(struct.pack("<Q", len(raw)) + raw).decode()
        return (f'<DataArray type="{TYPES[data.typecode]}" Name="{name}" '
                f'NumberOfComponents="{components}" format="binary">{text}</DataArray>\n')

    def section(tag, arrays):
        return f"<{tag}>{''.join(values(*item) for item in (arrays or {}).items())}</{tag}>\n"

    size = len(elements[0])
    n = len(elements)
    path.write_text(
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        f'header_type="UInt64">\n<UnstructuredGrid>\n<Piece NumberOfPoints="{len(coordinates) // 3}" '
        f'NumberOfCells="{n}">\n'
        + section("PointData", points) + section("CellData", cells)
        + f"<Points>{values('Points', coordinates, 3)}</Points>\n<Cells>\n"
        + values("connectivity", array("q", (node for nodes in elements for node in nodes)))
        + values("offsets", array("q", range(size, size * n + 1, size)))
        + values("types", array("B", [kind]) * n)
        + "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")


# Rounding of the surface: transition angle in degrees, and the bound on tension, in kPa.
ROUNDING = {"transition_angle": 29.0, "rounding": 0.1}
MFRONT = {"YoungModulus": "young_modulus", "PoissonRatio": "poisson_ratio", "Cohesion": "cohesion",
          "FrictionAngle": "friction_angle", "DilatancyAngle": "dilatancy_angle",
          "TransitionAngle": "transition_angle", "TensionCutOffParameter": "rounding"}


def project(mesh, elastic):
    """Full Newton iterations, a direct solver, the criterion |Δx|/|x| < 1e-7."""
    steps = 1 if elastic else INCREMENTS
    linear = ("<type>LinearElasticIsotropic</type><youngs_modulus>{0}_young_modulus</youngs_modulus>"
              "<poissons_ratio>{0}_poisson_ratio</poissons_ratio>")
    properties = "".join(f'<material_property name="{theirs}" parameter="soil_{ours}"/>'
                         for theirs, ours in MFRONT.items())
    soil = linear.format("soil") if elastic else (
        "<type>MFront</type><behaviour>MohrCoulombAbboSloan</behaviour>"
        f"<material_properties>{properties}</material_properties>")
    numbers = {f"soil_{name}": value for name, value in (SOIL | ROUNDING).items()}
    numbers |= {f"pile_{name}": value for name, value in PILE.items()}
    numbers |= {"zero": 0.0, "push": -PUSH, "pressure": PRESSURE}
    parameters = "".join(f"<parameter><name>{name}</name><type>Constant</type><value>{value}</value>"
                         "</parameter>\n" for name, value in numbers.items())
    for name, value in (("at_rest", "0 0"), ("initial", f"{-PRESSURE} {-PRESSURE} {-PRESSURE} 0")):
        parameters += (f"<parameter><name>{name}</name><type>Constant</type><values>{value}</values>"
                       "</parameter>\n")
    held = "".join(
        f"<boundary_condition><mesh>{line}</mesh><type>Dirichlet</type><component>{component}</component>"
        f"<parameter>{parameter}</parameter></boundary_condition>\n"
        for line, component, parameter in
        (("axis", 0, "zero"), ("wall", 0, "zero"), ("bottom", 1, "zero"), ("head", 1, "pushed")))
    if not elastic:
        held += ("<boundary_condition><mesh>top</mesh><type>NormalTraction</type>"
                 "<parameter>pressure</parameter></boundary_condition>\n")
    meshes = "".join(f'<mesh axially_symmetric="true">{name}.vtu</mesh>' for name in ("bulk", *mesh.lines))
    initial = "" if elastic else "<initial_stress>initial</initial_stress>"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<OpenGeoSysProject>
<meshes>{meshes}</meshes>
<processes><process>
  <name>SD</name><type>SMALL_DEFORMATION</type><integration_order>3</integration_order>
  <constitutive_relation id="0">{soil}</constitutive_relation>
  <constitutive_relation id="1">{linear.format("pile")}</constitutive_relation>
  <specific_body_force>0 0</specific_body_force>{initial}
  <process_variables><process_variable>displacement</process_variable></process_variables>
  <secondary_variables/>
</process></processes>
<media><medium id="0,1"><phases><phase><type>Solid</type><properties>
  <property><name>density</name><type>Constant</type><value>1</value></property>
</properties></phase></phases></medium></media>
<time_loop>
  <processes><process ref="SD">
    <nonlinear_solver>newton</nonlinear_solver>
    <convergence_criterion><type>DeltaX</type><norm_type>NORM2</norm_type><reltol>1e-7</reltol></convergence_criterion>
    <time_discretization><type>BackwardEuler</type></time_discretization>
    <time_stepping><type>FixedTimeStepping</type><t_initial>0</t_initial><t_end>{steps}</t_end>
      <timesteps><pair><repeat>{steps}</repeat><delta_t>1</delta_t></pair></timesteps></time_stepping>
  </process></processes>
  <output><type>VTK</type><prefix>pile</prefix><suffix>_{{:timestep}}</suffix>
    <data_mode>Binary</data_mode><compress_output>false</compress_output>
    <timesteps><pair><repeat>1</repeat><each_steps>{steps}</each_steps></pair></timesteps>
    <variables><variable>NodalForces</variable></variables></output>
</time_loop>
<parameters>
{parameters}<parameter><name>pushed</name><type>CurveScaled</type><curve>ramp</curve><parameter>push</parameter></parameter>
</parameters>
<curves><curve><name>ramp</name><coords>0 {steps}</coords><values>0 1</values></curve></curves>
<process_variables><process_variable><name>displacement</name><components>2</components><order>2</order>
  <initial_condition>at_rest</initial_condition>
  <boundary_conditions>{held}</boundary_conditions></process_variable></process_variables>
<nonlinear_solvers><nonlinear_solver><name>newton</name><type>Newton</type><max_iter>50</max_iter>
  <linear_solver>direct</linear_solver></nonlinear_solver></nonlinear_solvers>
<linear_solvers><linear_solver><name>direct</name>
  <eigen><solver_type>SparseLU</solver_type></eigen></linear_solver></linear_solvers>
</OpenGeoSysProject>
"""


def iterations(output):
    """Newton iterations of a run, from its log."""
    return output.count("Convergence criterion")


def increments_begun(output):
    """The last increment that a run began, from its log."""
    return max(map(int, re.findall(r"Time step #(\d+)", output)), default=0)


def head_force(folder, mesh, elastic):
    """Compression positive, N."""
    text = (folder / f"pile_{1 if elastic else INCREMENTS}.vtu").read_text(errors="replace")
    length = struct.calcsize("<Q" if 'header_type="UInt64"' in text else "<I")
    found = re.search(r'<DataArray[^>]*Name="NodalForces"[^>]*>\s*([A-Za-z0-9+/=]+)', text)
    # Length and values are encoded one after the other.
    start = -(-length // 3) * 4
    raw = base64.b64decode(found.group(1)[start:]) if "=" in found.group(1)[:start] else \
        base64.b64decode(found.group(1))[length:]
    forces = array("d")
    forces.frombytes(raw[: len(raw) // 8 * 8])
    return -1000.0 * sum(forces[2 * node + 1] for node in mesh.nodes_of("head"))
