"""Robot files as people have them: each is read rightly, or refused with link, attribute and cure."""

import resource
import time

import numpy as np
import pytest
import trimesh
from PIL import Image

from hecbench.errors import InputError
from hecbench.robots import sheets, urdf_files
from hecbench.robots.model import load_robot

BOX = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="{unit}"/><up_axis>{up}</up_axis></asset>
<library_images>{images}</library_images>
<library_effects>
<effect id="red"><profile_COMMON><technique sid="c"><lambert><diffuse><color>0.8 0.1 0.1 1</color></diffuse></lambert>
</technique></profile_COMMON></effect>
<effect id="skin"><profile_COMMON>
<newparam sid="surf"><surface type="2D"><init_from>{image}</init_from></surface></newparam>
<newparam sid="samp"><sampler2D><source>surf</source></sampler2D></newparam>
<technique sid="c"><lambert><diffuse><texture texture="samp" texcoord="UV"/></diffuse></lambert></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="R"><instance_effect url="#red"/></material>
<material id="S"><instance_effect url="#{effect}"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles material="a" count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3</p></triangles>
<polylist material="b" count="2"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3 3</vcount>
<p>0 3 2 1 2 3</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="a" target="#R"/><instance_material symbol="b" target="#{material}"/>
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
FINE = {"unit": 1, "up": "Z_UP", "images": "", "image": "no", "effect": "skin", "material": "R"}


def robot(*parts, links=("base", "la"), head='<robot name="r">'):
    named = "".join(f'<link name="{link}">{BOX}</link>' for link in links)
    return f"{head}{named}{''.join(parts)}</robot>"


def joint(name="a", kind="revolute", parent="base", child="la", inside=LIMIT):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<axis xyz="0 0 1"/>{inside}</joint>'


def shape(geometry, material=""):
    return f'<robot name="r"><link name="base"><visual>{geometry}{material}</visual></link></robot>'


@pytest.fixture
def load(tmp_path):
    def load(text):
        path = tmp_path / "r.urdf"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_robot(path)

    return load


def mesh(name, attributes=""):
    return f'<geometry><mesh filename="{name}" {attributes}/></geometry>'


FOLLOWS = '{}<mimic joint="{}" multiplier="{}" offset="{}"/>'


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (robot(joint(), links=("base", "la", "la")), "link 'la' is there twice"),
        (robot(joint(), joint(child="lb"), links=("base", "la", "lb")), "joint 'a' is there twice"),
        (robot(joint(), joint("b")), "child of two joints: link 'la'"),
        (robot(joint(child="nowhere")), "no 'nowhere'"),
        (robot(joint(inside=FOLLOWS.format(LIMIT, "ghost", 1, 0))), "mimics 'ghost', which is not there"),
        (robot(joint(inside=FOLLOWS.format(LIMIT, "a", 1, 0))), "mimics itself"),
        (robot(joint(inside=FOLLOWS.format(LIMIT, "ghost", "nan", 0))), 'multiplier is "nan"'),
        (robot(joint(kind="hinge")), "of type 'hinge'"),
        (
            robot(joint(), joint("b", "floating", "la", "lb"), links=("base", "la", "lb")),
            "make the joint fixed",
        ),
        (
            robot(joint(inside='<origin xyz="0 0"/>')),
            "joint 'a': origin: xyz is \"0 0\": give 3 finite numbers",
        ),
        (robot(joint(inside='<limit lower="low"/>')), "joint 'a': limit: lower is \"low\""),
        (robot(joint(inside='<origin xyz="0 0 ${h}"/>')), "expand the xacro first: run xacro r.urdf"),
        (robot(joint(inside='<origin xyz="$(arg x) 0 0"/>')), "expand the xacro first"),
        (
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/><xacro:arm prefix=""/></robot>',
            "it is a xacro, not a URDF",
        ),
        (shape(mesh("c.stl", 'scale="0.001"')), 'base.*scale is "0.001": give 3'),
        (shape(mesh("c.stl", 'scale="0.1, 0.1, 0.1"')), 'scale is "0.1, 0.1, 0.1"'),
        (shape(mesh("c.stl", 'scale="nan 1 1"')), 'scale is "nan 1 1"'),
        (shape(mesh("c.stl", 'scale="1 1 0"')), "no factor may be 0"),
        (shape(mesh("c.stl", 'scale="1 1e30 1"')), "no factor may be 0, below 1e-06 or above"),
        (shape(mesh("c.stl", 'scale="1e-30 1 1"')), "no factor may be 0, below 1e-06"),
        (robot(joint(inside='<origin xyz="0 0 1e300"/>')), "give metres, 10000 at most"),
        (robot(joint(inside='<origin quat_xyzw="0 0 0 0"/>')), "turns by nothing"),
        (shape("<geometry><mesh/></geometry>"), "link 'base': visual: mesh has no filename"),
        (shape('<geometry><box size="1 1"/></geometry>'), "link 'base': visual: box: size is \"1 1\""),
        (shape('<geometry><sphere radius="-1"/></geometry>'), "sizes must be positive"),
        (shape('<geometry><capsule radius="1"/></geometry>'), "capsule is not supported: use mesh, box"),
        ("<sdf><model/></sdf>", "holds <sdf>, not <robot>"),
        ("", "is empty"),
        ("<robot><link name='a'></robot>", "not a readable URDF: line 1"),
        ("<robot><link/></robot>", r"a link \(line 1\) has no name"),
        ("<robot>" + "<link name='a'>" * 100_000, "not a readable URDF"),
        (
            '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">'
            + "".join(f'<!ENTITY {b} "{f"&{a};" * 20}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
            + ']><robot><link name="&i;"/></robot>',
            "not a readable URDF",
        ),
        (
            '<!DOCTYPE r [<!ENTITY a SYSTEM "/etc/passwd">]><robot><link name="b">&a;</link></robot>',
            "entities",
        ),
    ],
)
def test_refused_with_place_and_cure(load, text, reason):
    began = time.process_time()
    with pytest.raises(InputError, match=reason) as refused:
        load(text)
    assert "r.urdf: " in str(refused.value)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 400
    assert time.process_time() - began < 2.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 4e6


@pytest.mark.parametrize(
    "text",
    [
        b'<?xml version="1.0" encoding="GBK"?><robot><link name="a"><!-- \xbb\xfa\xd0\xb5 --></link></robot>',
        b'<?xml version="1.0" encoding="utf-8"?><robot><link name="a"><!-- f\xfcr --></link></robot>',
        b'<robot><link name="a"><!-- f\xfcr --></link></robot>',
        b'\n\n<?xml version="1.0"?><robot><link name="a"/></robot>',
        b'\xef\xbb\xbf<robot><link name="a"/></robot>',
        '<?xml version="1.0" encoding="utf-16"?><robot><link name="a"/></robot>'.encode("utf-16"),
        b'<robot xmlns="http://drake.mit.edu"><link name="a"/></robot>',
        b'<robot drake:x="1"><link name="a" drake:y="2"><drake:z/></link></robot>',
    ],
)
def test_every_encoding_and_prefix_is_read_and_copied(load, tmp_path, text):
    assert load(text).links == ("a",)
    assert load_robot(urdf_files.copy(tmp_path / "r.urdf", tmp_path / "copy")).links == ("a",)


def test_chains_of_mimic_joints_are_resolved(load):
    links = ("base", "la", "lb", "lc")
    model = load(
        robot(
            joint("c", parent="lb", child="lc", inside=FOLLOWS.format(LIMIT, "b", 2, 0.1)),
            joint("b", parent="la", child="lb", inside=FOLLOWS.format(LIMIT, "a", -1, 0.2)),
            joint(),
            links=links,
        )
    )
    assert model.joint_names == ("a",)
    follower = -0.5 + 0.2
    turn = 0.5 + follower + 2 * follower + 0.1
    pose = model.forward([0.5], tip="lc")
    np.testing.assert_allclose(np.arctan2(pose[1, 0], pose[0, 0]), turn, atol=1e-12)
    np.testing.assert_allclose(model.forward([follower], ["b"], tip="lc"), pose, atol=1e-12)
    np.testing.assert_allclose(
        model.forward([2 * follower + 0.1, 0.5], ["c", "a"], tip="lc"), pose, atol=1e-12
    )
    with pytest.raises(InputError, match="named twice"):
        model.forward([0.0, 0.0], ["a", "a"], tip="lc")


def test_a_floating_base_stays_where_it_is(load):
    model = load(robot(joint("root", "floating", "world", "base"), joint(), links=("world", "base", "la")))
    assert model.joint_names == ("a",)
    assert "joint 'root' is floating or planar: it stays at its origin" in model.notes[0]
    np.testing.assert_allclose(model.forward([0.0], tip="la"), np.eye(4))


def _limits(lower, upper):
    return f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'


@pytest.mark.parametrize(
    ("kind", "limit", "position", "reason"),
    [
        ("revolute", _limits(0, 0), 0.5, r"the URDF limits a to 0..0, .*correct its <limit>"),
        ("revolute", _limits(1, -1), 0.0, "limits of a are reversed"),
        ("revolute", _limits(-3, 3), 90.0, "degrees instead of radians"),
        ("revolute", _limits(-3, 3), 3.5, "degrees instead of radians"),
        ("revolute", _limits(1, 3), -2.0, "another joint order, or a wrong <limit>"),
        ("prismatic", _limits(0, 0.04), 40.0, "millimetres instead of metres"),
        ("prismatic", _limits(0, 0.04), 0.05, "outside its limits 0 to 0.04"),
    ],
)
def test_limits_are_told_apart(load, kind, limit, position, reason):
    with pytest.raises(InputError, match=reason):
        load(robot(joint(kind=kind, inside=limit))).forward([position], tip="la")


@pytest.mark.parametrize(
    ("kind", "limit", "position"),
    [
        ("revolute", _limits(-6.28318530717, 6.28318530717), 2 * np.pi),
        ("prismatic", _limits(0, 0.04), 0.04003),
        ("revolute", _limits(-3, 3), -3.0005),
    ],
)
def test_a_hair_beyond_a_limit_is_taken_with_a_note(load, kind, limit, position):
    model = load(robot(joint(kind=kind, inside=limit)))
    assert np.isfinite(model.forward([position], tip="la")).all()
    assert "a hair beyond its limits" in model.beyond([position])[0]
    assert model.beyond([0.01]) == ()


@pytest.mark.parametrize("limit", ["", "<limit/>", '<limit effort="1"/>', _limits(-9, 9)])
def test_limits_may_be_absent(load, limit):
    assert np.isfinite(load(robot(joint(inside=limit))).forward([5.0], tip="la")).all()


def test_units_of_collada_are_applied_and_its_up_axis_is_not(load, tmp_path):
    for up in ("Y_UP", "Z_UP"):
        (tmp_path / "c.dae").write_text(DAE.format(**FINE | {"unit": 0.01, "up": up}))
        model = load(shape(mesh("c.dae")))
        np.testing.assert_allclose(model.parts[0].vertices.max(0), [0.01, 0.01, 0.01])
        assert model.notes == ("mesh c.dae: its unit of 0.01 m is applied",)


@pytest.mark.parametrize(
    "change",
    [{"material": "S"}, {"material": "S", "effect": "gone"}, {"material": "gone"}],
)
def test_a_broken_material_costs_a_colour_and_no_face(load, tmp_path, change):
    (tmp_path / "c.dae").write_text(DAE.format(**FINE | change))
    model = load(shape(mesh("c.dae")))
    assert [len(part.faces) for part in model.parts] == [2, 2]
    assert model.parts[0].colour == (0.8, 0.1, 0.1)
    assert model.parts[1].colour == (0.7, 0.7, 0.7)
    assert "mesh c.dae: material" in model.notes[0]


def test_textures_are_averaged_and_the_cache_sees_them(load, tmp_path):
    for shade in (60, 200):
        Image.fromarray(np.full((4, 4, 3), (255, shade, 0), np.uint8)).save(tmp_path / "t.png")
        image = '<image id="i"><init_from>t.png</init_from></image>'
        (tmp_path / "c.dae").write_text(DAE.format(**FINE | {"material": "S", "images": image, "image": "i"}))
        (tmp_path / "c.obj").write_text(
            "mtllib a b.mtl\nusemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\n"
            "f 1/1 3/2 2/1\nf 1/1 2/2 4/1\nf 1/1 4/2 3/1\nf 2/1 3/2 4/1\n"
        )
        (tmp_path / "a b.mtl").write_text("newmtl paint\nKd 1 1 1\nmap_Kd t.png\n")
        for name in ("c.dae", "c.obj"):
            part = load(shape(mesh(name))).parts[-1]
            np.testing.assert_allclose(part.colour, (1, shade / 255, 0), atol=0.01)


def test_negative_indices_count_back_from_their_line(load, tmp_path):
    (tmp_path / "c.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\nv 9 9 9\n"
    )
    (part,) = load(shape(mesh("c.obj"))).parts
    assert np.linalg.det(part.vertices[part.faces]).sum() / 6 == pytest.approx(1 / 6)


def test_an_obj_without_its_materials_is_grey_with_a_note(load, tmp_path):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "c.stl")
    (tmp_path / "c.obj").write_text("mtllib gone.mtl\nusemtl p\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    model = load(shape(mesh("c.obj")))
    assert model.parts[0].colour == (0.7, 0.7, 0.7)
    assert model.notes == ("mesh c.obj: its material file gone.mtl is missing: drawn grey",)


def test_urdf_colours_stand_unless_the_mesh_has_several(load, tmp_path):
    """A placeholder of the URDF does not paint over a mesh with colours of its own."""
    paint = '<material name="p"><color rgba="0 1 0 1"/></material>'
    for material, colours in (("S", {(0.8, 0.1, 0.1), (0.5, 0.5, 0.5)}), ("R", {(0.0, 1.0, 0.0)})):
        text = DAE.format(**FINE | {"material": material})
        grey = "<diffuse><color>0.5 0.5 0.5 1</color></diffuse>"
        text = text.replace('<diffuse><texture texture="samp" texcoord="UV"/></diffuse>', grey)
        (tmp_path / "c.dae").write_text(text)
        assert {part.colour for part in load(shape(mesh("c.dae"), paint)).parts} == colours


def test_a_material_may_be_defined_where_it_is_first_used(load):
    defined = '<material name="blue"><color rgba="0.1 0.2 0.9 1"/></material>'
    links = (
        f'<link name="{name}"><visual><geometry><box size="1 1 1"/></geometry>{material}</visual></link>'
        for name, material in (("base", '<material name="blue"/>'), ("la", defined))
    )
    model = load(f'<robot name="r">{"".join(links)}{joint()}</robot>')
    assert [part.colour for part in model.parts] == [(0.1, 0.2, 0.9)] * 2


@pytest.mark.parametrize("visual", ["", "<geometry/>"])
def test_a_visual_without_a_shape_is_left_out_with_a_note(load, visual):
    model = load(shape(visual))
    assert model.parts == ()
    assert "link 'base': visual without a shape" in model.notes[0]


@pytest.mark.parametrize(
    ("visual", "note"),
    [
        ('<geometry><box size="1 1 1"/><sphere radius="1"/></geometry>', "has 2 shapes: the first is drawn"),
        ('<geometry><box size="1 1 1"/></geometry><material name="x"/>', "material 'x' is defined nowhere"),
        (
            '<geometry><box size="1 1 1"/></geometry><material name="x"><color rgba="255 0 0 255"/></material>',
            "beyond 0..1: clipped",
        ),
    ],
)
def test_what_is_drawn_otherwise_than_told_is_noted(load, visual, note):
    model = load(shape(visual))
    assert len(model.parts[0].faces) == 12
    assert max(model.parts[0].colour) <= 1
    assert note in model.notes[0]


def test_an_origin_may_be_a_quaternion(load):
    turned = load(robot(joint(kind="fixed", inside='<origin xyz="1 0 0" quat_xyzw="0 0 2 2"/>')))
    by_angles = load(robot(joint(kind="fixed", inside='<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>')))
    np.testing.assert_allclose(turned.link_poses(np.zeros(0)), by_angles.link_poses(np.zeros(0)), atol=1e-12)


def test_an_obj_with_tabs_and_a_name_with_a_percent_sign(load, tmp_path):
    (tmp_path / "my mesh.obj").write_text("v\t0\t0\t0\r\nv\t1\t0\t0\r\nv\t0\t1\t0\r\nf\t1\t2\t3\r\n")
    assert len(load(shape(mesh("my%20mesh.obj"))).parts[0].faces) == 1


def test_faces_that_a_file_declares_and_does_not_hold_are_counted(load, tmp_path):
    binary = trimesh.creation.box((1, 1, 1)).export(file_type="stl")
    (tmp_path / "c.stl").write_bytes(binary[:80] + (99).to_bytes(4, "little") + binary[84:])
    with pytest.raises(InputError, match="0 of its 99 faces could be read"):
        load(shape(mesh("c.stl")))
    (tmp_path / "c.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n")
    with pytest.raises(InputError, match="a face names vertex 0, and OBJ counts from 1"):
        load(shape(mesh("c.obj")))


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
            "is a Git LFS pointer.*git lfs pull",
        ),
        (b"", "c.(stl|dae|obj|ply)"),
        (b"\x00" * 40, "c.(stl|dae|obj|ply)"),
        (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1e300 0 0\n", "c.(stl|dae|obj|ply)"),
    ],
)
@pytest.mark.parametrize("suffix", ["stl", "dae", "obj", "ply"])
def test_damaged_meshes_are_named(load, tmp_path, content, reason, suffix):
    (tmp_path / f"c.{suffix}").write_bytes(content)
    with pytest.raises(InputError, match=reason) as refused:
        load(shape(mesh(f"c.{suffix}")))
    assert "\n" not in str(refused.value)


def test_places_beyond_all_measure_are_refused(load, tmp_path):
    (tmp_path / "c.obj").write_text("v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"a vertex at 1e\+300 m"):
        load(shape(mesh("c.obj")))


def test_stl_of_every_kind_keeps_its_faces(load, tmp_path):
    box = trimesh.creation.box((1, 1, 1))
    ascii_stl = trimesh.exchange.stl.export_stl_ascii(box)
    (tmp_path / "two.stl").write_text(ascii_stl + "\n" + ascii_stl)
    binary = box.export(file_type="stl")
    (tmp_path / "solid.stl").write_bytes(b"solid cube".ljust(80) + binary[80:])
    assert sum(len(part.faces) for part in load(shape(mesh("two.stl"))).parts) == 24
    assert sum(len(part.faces) for part in load(shape(mesh("solid.stl"))).parts) == 12


@pytest.mark.parametrize(
    "prefix", ["package://pkg/", "model://pkg/", "package:\\\\pkg\\".replace("\\\\", "//"), "../"]
)
def test_a_mesh_is_found_by_the_longest_tail(tmp_path, prefix):
    """The visual mesh, not the collision mesh of the same name beside the URDF."""
    for folder, size in (("urdf", 0.1), ("visual", 0.2)):
        (tmp_path / folder).mkdir()
        trimesh.creation.box((size, size, size)).export(tmp_path / folder / "c.stl")
    path = tmp_path / "urdf" / "r.urdf"
    path.write_text(shape(mesh(f"{prefix}visual\\c.stl")))
    assert np.ptp(load_robot(path).parts[0].vertices) == pytest.approx(0.2)


def test_a_mesh_that_was_moved_within_its_package_is_found_below(tmp_path):
    for kind, size in (("collision", 0.1), ("visual", 0.2)):
        (tmp_path / "meshes" / kind).mkdir(parents=True)
        trimesh.creation.box((size, size, size)).export(tmp_path / "meshes" / kind / "c.stl")
    path = tmp_path / "r.urdf"
    path.write_text(shape(mesh("package://pkg/meshes/arm7/visual/c.stl")))
    assert np.ptp(load_robot(path).parts[0].vertices) == pytest.approx(0.2)
    path.write_text(shape(mesh("package://pkg/other/c.stl")))
    with pytest.raises(InputError, match="is not there"):
        load_robot(path)


def test_backs_are_drawn_where_they_are_seen():
    """A sheet and an open cup are seen from behind, closed bodies are not; a body turned inside out is all back."""
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    assert sheets.seen_from_behind(sheet.vertices, sheet.faces).all()
    for closed in (
        trimesh.creation.box((1, 2, 3)),
        trimesh.creation.icosphere(3),
        trimesh.creation.torus(1, 0.3),
    ):
        assert not sheets.seen_from_behind(closed.vertices, closed.faces).any()
        assert sheets.seen_from_behind(closed.vertices, closed.faces[:, ::-1]).any()
    cup = trimesh.creation.cylinder(1.0, 2.0)
    lidless = cup.faces[cup.face_normals[:, 2] < 0.5]
    assert sheets.seen_from_behind(cup.vertices, lidless).mean() > 0.9


def test_an_open_sheet_is_drawn_from_both_sides(load, tmp_path):
    from hecbench import se3
    from hecbench.rendering import Renderer, RenderMesh

    sheet = trimesh.Trimesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 0.4 - [0.2, 0.2, 0], [[0, 1, 2], [0, 2, 3]]
    )
    sheet.export(tmp_path / "c.stl")
    drawn = RenderMesh.of(load(shape(mesh("c.stl"))))
    covered = []
    for turn in (0.0, np.pi):
        renderer = Renderer(drawn, np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]]), 101, 101)
        pose = se3.make(se3.so3_exp(np.array([turn, 0.0, 0.0])), np.array([0, 0, 1.0]))
        renderer.draw(pose[None])
        covered.append((renderer.face >= 0).sum())
        assert (renderer.crossings.parts < 0).any()
    assert min(covered) > 1000
    assert max(covered) < 1.03 * min(covered)  # pixel centres on the rim


EXPECTED = {
    "axis_not_unit": (2, 24),
    "backslash_path": (1, 12),
    "collision_only": (0, 0),
    "dae_texture_reference_broken": (2, 24),
    "dae_unit_cm": (1, 12),
    "duplicate_joint": "joint 'a' is there twice",
    "duplicate_link": "link 'la' is there twice",
    "empty_geometry": (0, 0),
    "encoding_declared": (1, 12),
    "finger_a_hair_beyond_its_limit": (2, 24),
    "floating_root": (2, 24),
    "lfs_pointer": "c.dae: is a Git LFS pointer, not a mesh: run git lfs pull",
    "limit_without_effort": (2, 24),
    "limits_zero_zero": (2, 24),
    "material_defined_in_first_link": (2, 24),
    "millimetre_mesh_without_scale": (2, 24),
    "mimic_of_mimic": (4, 48),
    "model_uri": (1, 12),
    "negative_scale": (1, 12),
    "no_axis": (2, 24),
    "obj_mtl_missing": (1, 12),
    "obj_quads_negative_indices": (1, 12),
    "open_sheet": (1, 2),
    "robot_without_name": (1, 12),
    "same_name_beside_the_urdf": (1, 12),
    "scale_commas": 'scale is "0.001, 0.001, 0.001"',
    "scale_one_number": 'scale is "0.001"',
    "spaces_and_umlauts": (2, 24),
    "stl_ascii_two_solids": (2, 24),
    "stl_binary_starting_with_solid": (1, 12),
    "unbound_prefix": (2, 24),
    "visual_without_geometry": (0, 0),
    "xacro_expressions": "expand the xacro first",
    "xacro_not_expanded": "it is a xacro, not a URDF",
}


@pytest.mark.parametrize("case", EXPECTED)
def test_shared_cases(shared, case, tmp_path):
    for file in sorted((shared / "cases" / "robot" / case).rglob("*.urdf")):
        expected = EXPECTED[case]
        if isinstance(expected, str):
            with pytest.raises(InputError, match=expected):
                load_robot(file)
            continue
        model = load_robot(file)
        assert (len(model.parts), sum(len(part.faces) for part in model.parts)) == expected
        copied = load_robot(urdf_files.copy(file, tmp_path / file.stem))
        assert [part.colour for part in copied.parts] == [part.colour for part in model.parts]
