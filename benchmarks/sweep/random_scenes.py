# SPDX-License-Identifier: Apache-2.0
"""Small random scenes, and the same scenes written otherwise: what sweep.py renders.

A scene is a list of parts with a placement (4 x 4 matrix) each. A `Variant` says how it is written: a map `world` that
is applied to everything, and what is done to the meshes' files. No variant changes what is to be seen, except that a
mirrored scene is seen mirrored.
"""
import dataclasses
import pathlib

import numpy


@dataclasses.dataclass(frozen=True)
class Variant:
    name: str
    world: numpy.ndarray = dataclasses.field(default_factory=lambda: numpy.eye(4))  # a similarity
    rewind: str = ""  # "all": triangles and normals reversed, then flip_normals; "order": triangles that have normals
    reindex: bool = False  # vertices permuted and doubled, triangles permuted and turned
    tolerance: float = 1e-3  # relative difference that is no difference

    @property
    def scale(self):
        return abs(numpy.linalg.det(self.world[:3, :3])) ** (1 / 3)

    @property
    def rounding(self):
        """The distance of neighbouring floats where the scene is, in units of the first variant."""
        return numpy.spacing(numpy.float32(abs(self.world[:3, 3]).max())) / self.scale

    @property
    def mirrors(self):
        return numpy.linalg.det(self.world[:3, :3]) < 0


def scaled(x, y=None, z=None):
    return numpy.diag([x, x if y is None else y, x if z is None else z, 1.0])


def moved(offset):
    matrix = numpy.eye(4)
    matrix[:3, 3] = offset
    return matrix


def turned(random):
    """A uniformly distributed rotation."""
    q, r = numpy.linalg.qr(random.normal(size=(3, 3)))
    q = q * numpy.sign(numpy.diag(r))
    matrix = numpy.eye(4)
    matrix[:3, :3] = q * numpy.linalg.det(q)
    return matrix


def numbers(values):
    return ", ".join(f"{value:.9g}" for value in numpy.ravel(values))


def colour(random, low=0.1, high=0.9):
    return f'value="{numbers(random.uniform(low, high, 3))}"'


# ---- meshes ---------------------------------------------------------------------------------------------------------

CUBE = numpy.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
OCTAHEDRON = numpy.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)


@dataclasses.dataclass
class Mesh:
    positions: numpy.ndarray
    triangles: numpy.ndarray
    normals: numpy.ndarray | None = None
    uvs: numpy.ndarray | None = None


def ball(n_divisions):
    """An octahedron whose faces are divided in four, each vertex on the unit sphere, with smooth normals."""
    points = [tuple(p) for p in OCTAHEDRON]
    faces = [(x, y, z) if (x + y + z) % 2 == 0 else (y, x, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    for _ in range(n_divisions):
        divided = []
        for a, b, c in faces:
            middles = []
            for p, q in ((a, b), (b, c), (c, a)):
                middle = numpy.add(points[p], points[q])
                middle = tuple(numpy.round(middle / numpy.linalg.norm(middle), 12))
                if middle not in points:
                    points.append(middle)
                middles.append(points.index(middle))
            ab, bc, ca = middles
            divided += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = divided
    positions = numpy.array(points)
    corner = positions[numpy.array(faces)]
    outwards = numpy.einsum("ij,ij->i", numpy.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]),
                            corner.sum(axis=1)) > 0
    triangles = numpy.where(outwards[:, None], faces, numpy.array(faces)[:, ::-1])
    return Mesh(positions, triangles, positions.copy())


def box(with_uvs):
    """A cube with outward normals, four vertices per face."""
    mesh = Mesh(numpy.zeros((24, 3)), numpy.zeros((12, 3), int), numpy.zeros((24, 3)))
    mesh.uvs = numpy.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (6, 1)).astype(float) if with_uvs else None
    for f, corners in enumerate(CUBE_FACES):
        mesh.positions[4 * f:4 * f + 4] = CUBE[list(corners)]
        mesh.normals[4 * f:4 * f + 4] = CUBE[list(corners)].mean(axis=0)
        mesh.triangles[2 * f:2 * f + 2] = [[4 * f, 4 * f + 1, 4 * f + 2], [4 * f, 4 * f + 2, 4 * f + 3]]
    return mesh


def random_mesh(random):
    mesh = ball(int(random.integers(0, 3))) if random.random() < 0.5 else box(random.random() < 0.5)
    if random.random() < 0.3:
        mesh.normals = None
    return mesh


def rewritten(mesh, variant, random, keeps_order):
    """The mesh as its file has it, and whether flip_normals must be set. The order of vertices says on which side a
    medium is, vertex normals where the front is."""
    mesh = dataclasses.replace(mesh)
    flip = variant.rewind == "all"
    if flip or (variant.rewind == "order" and mesh.normals is not None and not keeps_order):
        mesh.triangles = mesh.triangles[:, ::-1]
    if flip and mesh.normals is not None:
        mesh.normals = -mesh.normals
    if variant.reindex:
        n = len(mesh.positions)
        # Doubled vertices would change the normals that are computed for meshes without.
        doubled = [] if mesh.normals is None else random.integers(n, size=n)
        source = numpy.concatenate([numpy.arange(n), doubled]).astype(int)
        source = random.permutation(source)
        triangles = numpy.array([[random.choice(numpy.flatnonzero(source == corner)) for corner in triangle]
                                 for triangle in mesh.triangles])
        triangles = numpy.array([numpy.roll(triangle, random.integers(3)) for triangle in triangles])
        mesh = Mesh(mesh.positions[source], random.permutation(triangles),
                    None if mesh.normals is None else mesh.normals[source],
                    None if mesh.uvs is None else mesh.uvs[source])
    return mesh, flip


def write_obj(mesh, path):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.positions]
    if mesh.uvs is not None:
        lines += [f"vt {u:.9g} {v:.9g}" for u, v in mesh.uvs]
    if mesh.normals is not None:
        lines += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.normals]

    def corner(i):
        uv = i + 1 if mesh.uvs is not None else ""
        return f"{i + 1}/{uv}" + (f"/{i + 1}" if mesh.normals is not None else "")

    lines += ["f " + " ".join(corner(i) for i in triangle) for triangle in mesh.triangles]
    path.write_text("\n".join(lines) + "\n")


def write_ply(mesh, path):
    rows, names = mesh.positions, "xyz"
    properties = [f"property float {name}" for name in names]
    if mesh.normals is not None:
        rows = numpy.hstack([rows, mesh.normals])
        properties += [f"property float n{name}" for name in names]
    if mesh.uvs is not None:
        rows = numpy.hstack([rows, mesh.uvs])
        properties += ["property float u", "property float v"]
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *properties,
            f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header"]
    body = [" ".join(f"{value:.9g}" for value in row) for row in rows]
    path.write_text("\n".join(head + body + [f"3 {a} {b} {c}" for a, b, c in mesh.triangles]) + "\n")


# ---- materials ------------------------------------------------------------------------------------------------------

def texture(random, name, has_uvs=True):
    if random.random() < 0.7 or not has_uvs:
        return f'<rgb name="{name}" {colour(random)}/>'
    return (f'<texture name="{name}" type="checkerboard"><rgb name="color0" {colour(random)}/>'
            f'<rgb name="color1" {colour(random)}/></texture>')


def opaque(random, has_uvs=True):
    rough = f'<float name="alpha" value="{random.uniform(0.1, 0.5):.3g}"/>'
    kind = random.integers(7)
    if kind == 0:
        return '<bsdf type="conductor"><string name="material" value="Al"/></bsdf>'
    if kind == 1:
        return f'<bsdf type="roughconductor"><string name="material" value="Cu"/>{rough}</bsdf>'
    if kind == 2:
        return f'<bsdf type="plastic">{texture(random, "diffuse_reflectance", has_uvs)}</bsdf>'
    if kind == 3:
        return f'<bsdf type="roughplastic">{texture(random, "diffuse_reflectance", has_uvs)}{rough}</bsdf>'
    if kind == 4:
        return (f'<bsdf type="principled">{texture(random, "base_color", has_uvs)}'
                f'<float name="roughness" value="{random.uniform(0.2, 0.9):.3g}"/></bsdf>')
    return f'<bsdf type="diffuse">{texture(random, "reflectance", has_uvs)}</bsdf>'


def material(random, closed, has_uvs=True):
    """Of a closed surface, perhaps glass; half of the others are two-sided."""
    if closed and random.random() < 0.3:
        return random.choice(['<bsdf type="dielectric"/>', '<bsdf type="thindielectric"/>',
                              '<bsdf type="roughdielectric"><float name="alpha" value="0.2"/></bsdf>'])
    model = opaque(random, has_uvs)
    return f'<bsdf type="twosided">{model}</bsdf>' if random.random() < 0.5 else model


def medium(random, scale):
    albedo, extinction = random.uniform(0.3, 0.95, 3), random.uniform(0.5, 3) / scale
    return (f'<medium type="homogeneous" name="interior"><rgb name="albedo" value="{numbers(albedo)}"/>'
            f'<float name="sigma_t" value="{extinction:.9g}"/></medium>')


# ---- scenes ---------------------------------------------------------------------------------------------------------

class Writer:
    """Writes one variant of the scene of a seed. Random numbers of the scene and of the variant are separate."""

    def __init__(self, seed, variant, folder, with_media):
        self.random = numpy.random.default_rng(seed)
        self.shuffle = numpy.random.default_rng(seed + 1)
        self.variant, self.folder, self.with_media = variant, pathlib.Path(folder), with_media
        self.xml, self.n_files = [], 0
        self.finest = 0.1  # size of the finest detail

    def to_world(self, placement):
        return f'<transform name="to_world"><matrix value="{numbers(self.variant.world @ placement)}"/></transform>'

    def point(self, p):
        return (self.variant.world @ numpy.append(p, 1))[:3]

    def file(self, ending):
        self.n_files += 1
        return self.folder / f"{self.variant.name}{self.n_files}.{ending}"

    def placement(self, low=0.2, high=0.6):
        return moved(self.random.uniform([-1.6, 0.2, -1.6], [1.6, 1.8, 1.2])) @ turned(self.random) @ scaled(
            self.random.uniform(low, high))

    def shape(self, kind, placement, inside, more=""):
        self.xml.append(f'<shape type="{kind}">{self.to_world(placement)}{more}{inside}</shape>')

    def mesh(self, mesh, placement, inside, face_normals=False):
        keeps_order = "<medium" in inside or face_normals
        written, flip = rewritten(mesh, self.variant, self.shuffle, keeps_order)
        kind = "obj" if self.random.random() < 0.5 else "ply"
        path = self.file(kind)
        (write_obj if kind == "obj" else write_ply)(written, path)
        more = f'<string name="filename" value="{path.name}"/>'
        more += '<boolean name="flip_normals" value="true"/>' if flip else ""
        more += '<boolean name="face_normals" value="true"/>' if face_normals else ""
        more += '<boolean name="flip_tex_coords" value="false"/>'
        if placement is None:
            return f'<shape type="{kind}">{more}{inside}</shape>'
        self.shape(kind, placement, inside, more)

    def light(self, low=1, high=6):
        return f'<emitter type="area"><rgb name="radiance" {colour(self.random, low, high)}/></emitter>'

    def random_part(self):
        random, kind = self.random, self.random.integers(9)
        placement = self.placement()
        if kind <= 2:  # a mesh
            mesh, uneven = random_mesh(random), scaled(*random.uniform(0.5, 1.2, 3))
            inside = material(random, True, mesh.uvs is not None)
            if random.random() < 0.25:
                inside += self.light()
            elif self.with_media and random.random() < 0.4:
                inside = random.choice(['<bsdf type="null"/>', '<bsdf type="dielectric"/>']) + medium(
                    random, self.variant.scale)
            self.mesh(mesh, placement @ uneven, inside, random.random() < 0.3)
        elif kind == 3:
            self.shape("sphere", placement, material(random, True) + (self.light() if random.random() < 0.2 else ""))
        elif kind == 4:  # a thin coat of glass
            gap = 10 ** random.uniform(-3, -1)
            self.finest = min(self.finest, 0.2 * gap)
            self.shape("sphere", placement, opaque(random))
            self.shape("sphere", placement @ scaled(1 + gap), '<bsdf type="dielectric"/>')
        elif kind == 5:
            flat = random.choice(["disk", "rectangle", "cylinder"])
            self.shape(flat, placement, material(random, False) + (self.light() if random.random() < 0.3 else ""))
        elif kind == 6:  # a lamp with a shade
            self.shape("cylinder", placement @ scaled(1.2), f'<bsdf type="twosided">{opaque(random)}</bsdf>')
            self.shape("sphere", placement @ scaled(0.4), self.light(5, 20))
        elif kind == 7:
            self.curve(placement)
        else:
            self.instances()

    def curve(self, placement):
        points = self.random.uniform(-1.5, 1.5, (6, 3)) @ placement[:3, :3].T + placement[:3, 3]
        radius = self.random.uniform(0.02, 0.08) * self.variant.scale
        path = self.file("txt")
        path.write_text("".join(f"{x:.9g} {y:.9g} {z:.9g} {radius:.9g}\n" for x, y, z in map(self.point, points)))
        kind = self.random.choice(["linearcurve", "bsplinecurve"])
        self.xml.append(f'<shape type="{kind}"><string name="filename" value="{path.name}"/>'
                        f'{opaque(self.random)}</shape>')

    def instances(self):
        name = f"group{self.n_files}-{len(self.xml)}"
        mesh = random_mesh(self.random)
        inside = self.mesh(mesh, None, material(self.random, True, mesh.uvs is not None))
        self.xml.append(f'<shape type="shapegroup" id="{name}">{inside}</shape>')
        for _ in range(2):
            mirror = scaled(-1, 1, 1) if self.random.random() < 0.5 else numpy.eye(4)
            self.shape("instance", self.placement(0.15, 0.4) @ mirror, f'<ref id="{name}"/>')

    def lights(self):
        random, scale = self.random, self.variant.scale
        kind = random.integers(4)
        self.xml.append(f'<emitter type="constant"><rgb name="radiance" {colour(random, 0.1, 0.5)}/></emitter>')
        if kind == 0:
            intensity = numbers(random.uniform(2, 8, 3) * scale ** 2)
            self.xml.append(f'<emitter type="point"><point name="position" value="'
                            f'{numbers(self.point(random.uniform([-1, 2.2, 0], [1, 2.8, 2])))}"/>'
                            f'<rgb name="intensity" value="{intensity}"/></emitter>')
        elif kind <= 2:  # a ceiling lamp that shines downwards
            down = moved([0, 2.9, 0]) @ numpy.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
            self.shape("rectangle", down @ scaled(0.5), self.light(4, 10))

    def write(self):
        floor = moved([0, -0.6, 0]) @ numpy.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
        self.shape("rectangle", floor @ scaled(4), f'<bsdf type="diffuse">{texture(self.random, "reflectance")}</bsdf>')
        self.lights()
        for _ in range(self.random.integers(3, 7)):
            self.random_part()
        s = self.variant.scale
        origin, target = self.point([0.3, 1.4, 5.5]), self.point([0, 0.7, 0])
        up = self.variant.world[:3, :3] @ [0, 1, 0]
        camera = (f'<sensor type="perspective"><float name="fov" value="42"/>'
                  f'<float name="near_clip" value="{0.01 * s:.9g}"/><float name="far_clip" value="{1e4 * s:.9g}"/>'
                  f'<transform name="to_world"><lookat origin="{numbers(origin)}" target="{numbers(target)}" '
                  f'up="{numbers(up)}"/></transform><film type="hdrfilm"><integer name="width" value="32"/>'
                  f'<integer name="height" value="32"/><rfilter type="box"/></film></sensor>')
        path = self.folder / f"{self.variant.name}.xml"
        if self.finest < 4 * self.variant.rounding:
            return None
        path.write_text('<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="8"/>'
                        "</integrator>\n" + camera + "\n" + "\n".join(self.xml) + "\n</scene>\n")
        return path


def variants():
    """All ways to write a scene; the first is the one that the others are compared with."""
    mirror = scaled(-1, 1, 1)
    result = [Variant("first"), Variant("mirrored", mirror), Variant("rewound", rewind="all"),
              Variant("reordered", rewind="order"), Variant("reindexed", reindex=True)]
    for distance, tolerance in ((10, 1e-3), (1e3, 3e-3), (1e5, 5e-2)):
        result.append(Variant(f"moved{distance:g}", moved(distance * numpy.array([0.6, -0.48, 0.64])),
                              tolerance=tolerance))
    for factor in (1e-3, 0.1, 7.3, 1e3):
        result.append(Variant(f"scaled{factor:g}", scaled(factor)))
    result.append(Variant("all", moved([8, -5, 3]) @ scaled(-20, 20, 20), rewind="all", reindex=True))
    return result


def write_scene(seed, variant, folder, with_media):
    """The scene's file; None if floats cannot hold the scene."""
    return Writer(seed, variant, folder, with_media).write()
