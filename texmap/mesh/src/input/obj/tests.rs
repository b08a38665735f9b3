//! OBJ and MTL on small files made here, and against the crate `tobj`.

use std::path::PathBuf;

use resample_io::Gate;
use tempfile::TempDir;

use crate::Error;
use crate::input::{LoadOptions, Loaded, Unreadable, load};
use crate::scene::{AlphaMode, Lighting, Scene, Texels, Wrap};

/// A folder with an OBJ, and what else is written into it.
struct Folder(TempDir);

/// A square with coordinates: the picture's lower left corner is at the origin, as OBJ has it.
const SQUARE: &str =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n";

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).expect("written");
        path
    }

    fn load(&self, obj: impl AsRef<[u8]>) -> Result<Loaded, Error> {
        load(&self.write("a.obj", obj), &LoadOptions::default())
    }

    fn scene(&self, obj: impl AsRef<[u8]>) -> Scene {
        self.load(obj).expect("a good file").scene
    }

    /// Two texels side by side, red and green; the right one is half transparent.
    fn picture(&self, name: &str) {
        let mut picture = image::RgbaImage::from_pixel(2, 1, image::Rgba([255, 0, 0, 255]));
        picture.put_pixel(1, 0, image::Rgba([0, 255, 0, 128]));
        picture.save(self.0.path().join(name)).expect("written");
    }
}

fn refusal(obj: &str) -> String {
    Folder::new().load(obj).expect_err("a bad file").to_string()
}

#[test]
fn v_points_down_and_normals_have_length_one() {
    let scene = Folder::new().scene(format!("{SQUARE}f 1/1/1 2/2/1 3/3/1 4/4/1"));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles.len(), 2, "a square");
    let top_left = mesh
        .positions
        .iter()
        .position(|&pos| pos == [0.0, 1.0, 0.0])
        .expect("the corner");
    assert_eq!(
        mesh.uvs[0][top_left],
        [0.0, 0.0],
        "the upper left corner has the picture's first texel"
    );
    assert_eq!(mesh.normals[top_left], [0.0, 0.0, 1.0], "length 1");
}

#[test]
fn numbers_count_from_either_end_and_parts_may_be_missing() {
    let folder = Folder::new();
    for face in [
        "f 1 2 3 4",
        "f -4 -3 -2 -1",
        "f 1//1 2//1 3//1 4//1",
        "f 1/1 2/2 3/3 4/4",
        "f 1/1/1 2 3//1 4",
    ] {
        let scene = folder.scene(format!("{SQUARE}{face}"));
        let corners: Vec<_> = scene.meshes[0].triangles.iter().flatten().collect();
        assert_eq!(
            (scene.meshes[0].positions.len(), corners.len()),
            (4, 6),
            "{face}: a square"
        );
    }
    let Loaded { scene, notes } = folder
        .load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//1 3//1")
        .expect("a good file");
    assert!(
        scene.meshes[0].normals.is_empty() && notes.len() == 1,
        "normals that no line gives: {notes:?}"
    );
    let mixed = folder.scene(format!("{SQUARE}f 1/1 2/2 3/3\nf 1 3 4"));
    let with: Vec<_> = mixed.meshes.iter().map(|mesh| mesh.uvs.len()).collect();
    assert_eq!(
        with,
        [1, 0],
        "a triangle without coordinates takes none from the other"
    );
}

#[test]
fn bad_lines_are_named() {
    for (line, said) in [
        ("f 1 2 5", "there is no v 5 among 4"),
        ("f 0 1 2", "there is no v 0"),
        ("f -5 1 2", "there is no v -5"),
        ("f 1/9 2/9 3/9", "there is no vt 9 among 4"),
        ("f a b c", "there is no v a"),
        ("f /1 /2 /3", "no position"),
        ("v 1 2", "expected 3 numbers"),
        ("v 1 2 x", "'x' is no number"),
    ] {
        let error = refusal(&format!("{SQUARE}{line}"));
        assert!(
            error.contains("line 10") && error.contains(said),
            "'{line}': {error}"
        );
    }
    assert!(
        refusal("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3").contains("finite"),
        "not a number"
    );
    assert!(
        refusal("v 0 0 0\n").contains("no triangles"),
        "nothing to draw"
    );
    assert!(refusal("hello\n").contains("known format"), "no OBJ at all");
}

#[test]
fn text_of_other_systems_is_read() {
    let folder = Folder::new();
    let obj = "\u{feff}v 0 0 0\r\nv 1 0 0\r\nv 0 \\\r\n1 0\r\nf 1 2 3\r\n";
    assert_eq!(
        folder.scene(obj).meshes[0].positions[2],
        [0.0, 1.0, 0.0],
        "a mark, and a line that goes on"
    );
    let wide: Vec<u8> = obj.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(folder.scene(wide).meshes.len(), 1, "UTF-16");
    assert_eq!(
        folder
            .scene(b"# caf\xe9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3")
            .meshes
            .len(),
        1,
        "Latin-1"
    );
}

#[test]
fn vertex_colours_become_linear() {
    let scene = Folder::new().scene("v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3");
    let [first, second, _] = scene.meshes[0].colours[..] else {
        panic!("three colours")
    };
    let half = resample_core::image::linear_from_srgb(0.5);
    assert_eq!(
        (first, second),
        ([1.0, half, 0.0, 1.0], [1.0; 4]),
        "decoded, and white where there is none"
    );
}

#[test]
fn materials_have_colour_alpha_and_maps() {
    let folder = Folder::new();
    folder.picture("t.png");
    folder.write(
        "a b.mtl",
        "newmtl plain\nKd 1 0.5 0\nillum 0\nnewmtl glass\nTr 0.75\nnewmtl wood grain\nKd 0 0 0\n\
         map_Kd -s 2 3 -o 0.25 0.5 -clamp on .\\T.PNG\nnewmtl leaf\nmap_Kd t.png\nmap_d t.png\nKd x\n",
    );
    let faces = ["plain", "glass", "wood grain", "leaf"]
        .map(|name| format!("usemtl {name}\nf 1/1 2/2 3/3\n"));
    let Loaded { scene, notes } = folder
        .load(format!("mtllib a b.mtl\n{SQUARE}{}", faces.concat()))
        .expect("a good file");
    let material = |name: &str| {
        scene
            .materials
            .iter()
            .find(|m| m.name == name)
            .expect("a material")
    };
    let half = resample_core::image::linear_from_srgb(0.5);
    assert_eq!(
        material("plain").base_colour,
        [1.0, half, 0.0, 1.0],
        "Kd is as on a screen"
    );
    assert_eq!(material("plain").lighting, Lighting::Unlit, "illum 0");
    assert_eq!(
        (material("glass").base_colour[3], material("glass").alpha),
        (0.25, AlphaMode::Blend),
        "1 - Tr"
    );
    let wood = material("wood grain");
    assert_eq!(
        wood.base_colour, [1.0; 4],
        "a black Kd beside a map means white"
    );
    let used = wood
        .base_texture
        .expect("a map, by its last part in any case");
    assert_eq!(used.wrap, [Wrap::Clamp; 2], "-clamp");
    // The lower left corner, v = 1 from the top: 0.25 and 0.5 from the bottom.
    let corner = used.uv_linear * glam::DVec2::new(0.0, 1.0) + used.uv_offset;
    assert!(
        (corner - glam::DVec2::new(0.25, 0.5)).length() < 1e-12,
        "-s and -o count from the bottom: {corner}"
    );
    let leaf = material("leaf");
    let Texels::Srgb8(texels) = &scene.textures[leaf.base_texture.expect("a map").texture].texels
    else {
        panic!("8 bits")
    };
    assert_eq!(
        (leaf.alpha, texels[1]),
        (AlphaMode::Blend, [0, 255, 0, 128]),
        "alpha from map_d's own channel"
    );
    assert!(
        notes.iter().any(|note| note.contains("line 12")),
        "the line that is no colour is told: {notes:?}"
    );
}

#[test]
fn opacity_is_d_before_tr_and_tr_1_alone_is_opaque() {
    let folder = Folder::new();
    for (lines, expected) in [
        ("Tr 0.25", 0.75),
        ("d 0.5\nTr 0.25", 0.5),
        ("Tr 0.25\nd 0.5", 0.5),
        ("Tr 1", 1.0),
    ] {
        folder.write("a.mtl", format!("newmtl m\n{lines}\n"));
        let scene = folder.scene(format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3"));
        assert_eq!(scene.materials[0].base_colour[3], expected, "{lines}");
    }
}

#[test]
fn a_texture_can_be_bound_by_hand() {
    let folder = Folder::new();
    folder.picture("t.png");
    let texture = Some(folder.0.path().join("t.png"));
    let options = LoadOptions {
        texture,
        ..LoadOptions::default()
    };
    let bound = |obj: String| load(&folder.write("a.obj", obj), &options);
    let scene = bound(format!("{SQUARE}f 1/1 2/2 3/3"))
        .expect("a good file")
        .scene;
    assert!(
        scene.materials[0].base_texture.is_some() && scene.textures.len() == 1,
        "bound"
    );
    let error = bound(format!("{SQUARE}f 1 2 3"))
        .expect_err("no coordinates")
        .to_string();
    assert!(
        error.contains("texture") && error.contains("coordinates"),
        "{error}"
    );
}

#[test]
fn real_files_agree_with_tobj() {
    let data = std::env::var_os("RESAMPLE_DATA").map(PathBuf::from);
    let data = data
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"));
    let folder = data.join("meshes/obj");
    for name in [
        "pytorch3d/cow_mesh/cow.obj",
        "viking_room/viking_room.obj",
        "trimesh/fuze.obj",
    ] {
        let path = folder.join(name);
        if !path.is_file() {
            println!("skipped: {} is not there", path.display());
            continue;
        }
        let theirs = tobj::load_obj(&path, &tobj::GPU_LOAD_OPTIONS)
            .expect("tobj reads it")
            .0;
        let mut theirs: Vec<_> = theirs
            .iter()
            .flat_map(|model| corners_of_tobj(&model.mesh))
            .collect();
        let scene = load(&path, &LoadOptions::default())
            .expect("a good file")
            .scene;
        let mut ours: Vec<[u32; 5]> = Vec::new();
        for mesh in &scene.meshes {
            ours.extend(mesh.triangles.iter().flatten().map(|&i| {
                let ([x, y, z], [u, v]) = (mesh.positions[i as usize], mesh.uvs[0][i as usize]);
                [x, y, z, u, v].map(f32::to_bits)
            }));
        }
        theirs.sort_unstable();
        ours.sort_unstable();
        assert!(
            ours == theirs,
            "{name}: {} corners, {} of tobj: they differ",
            ours.len(),
            theirs.len()
        );
    }
}

fn corners_of_tobj(mesh: &tobj::Mesh) -> Vec<[u32; 5]> {
    let corner = |&i: &u32| {
        let (pos, uv) = (
            &mesh.positions[3 * i as usize..],
            &mesh.texcoords[2 * i as usize..],
        );
        [pos[0], pos[1], pos[2], uv[0], 1.0 - uv[1]].map(f32::to_bits)
    };
    mesh.indices.iter().map(corner).collect()
}

fn face(rest: &str) -> String {
    format!("mtllib a.mtl\n{SQUARE}usemtl m\n{rest}f 1/1 2/2 3/3")
}

#[test]
fn what_is_missing_is_an_error_or_leaves_the_colour_and_a_note() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl m\nKd 1 0 0\nmap_Kd nothing.png\n");
    let error = folder.load(face("")).expect_err("no picture").to_string();
    assert!(
        error.contains("nothing.png") && error.contains("--textures left-out"),
        "{error}"
    );
    let options = LoadOptions {
        unreadable: Unreadable::Noted,
        ..LoadOptions::default()
    };
    let path = folder.write("a.obj", face("mtllib none.mtl\n"));
    let Loaded { scene, notes } = load(&path, &options).expect("the mesh can be had");
    assert_eq!(scene.materials[0].base_colour, [1.0, 0.0, 0.0, 1.0], "Kd");
    assert!(scene.materials[0].base_texture.is_none(), "no texture");
    assert_eq!(notes.len(), 2, "the file and the picture: {notes:?}");
}

#[test]
fn a_file_that_is_named_often_is_looked_for_once() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl m\nKd 1 0 0\n");
    let gate = Gate::default();
    let options = LoadOptions {
        gate: gate.clone(),
        ..LoadOptions::default()
    };
    let path = folder.write("a.obj", face(&"mtllib a.mtl\n".repeat(3000)));
    load(&path, &options).expect("a good file");
    assert_eq!(gate.files().len(), 1, "each file once");
}

#[test]
fn physical_materials_are_read() {
    let folder = Folder::new();
    let grey = |name: &str, side: u32, code: u8| {
        let picture = image::GrayImage::from_pixel(side, side, image::Luma([code]));
        picture.save(folder.0.path().join(name)).expect("written");
    };
    grey("rough.png", 4, 51);
    grey("metal.png", 2, 204);
    folder.picture("n.png");
    let physical = |lines: &str| {
        folder.write("a.mtl", format!("newmtl m\n{lines}\n"));
        let Loaded { scene, notes } = folder.load(face("")).expect("a good file");
        assert!(notes.is_empty(), "{notes:?}");
        let physical = scene.materials[0].physical.expect("a physical material");
        (scene, physical)
    };
    let (_, plain) = physical("Pr 0.25\nPm 0.75");
    assert_eq!((plain.roughness, plain.metal), (0.25, 0.75));
    let texel = |scene: &Scene, texture: usize| match &scene.textures[texture].texels {
        Texels::Srgb8(texels) => (texels.len(), texels[0]),
        Texels::LinearF32(_) => panic!("8 bits"),
    };
    let (scene, both) =
        physical("Pr 0\nPm 0.5\nmap_Pr rough.png\nmap_Pm metal.png\nnorm -bm 0.5 n.png");
    assert_eq!(
        (both.roughness, both.metal, both.normal_scale),
        (1.0, 1.0, 0.5),
        "maps stand for the numbers"
    );
    let map = both.metal_roughness_texture.expect("a map").texture;
    assert_eq!(texel(&scene, map), (16, [255, 51, 204, 255]));
    assert!(both.normal_texture.is_some(), "and normals");
    let (scene, one) = physical("Pm 0.5\nmap_Pr -imfchan g n.png");
    assert_eq!(
        (one.roughness, one.metal),
        (1.0, 0.5),
        "one map, one number"
    );
    let map = one.metal_roughness_texture.expect("a map").texture;
    assert_eq!(
        texel(&scene, map),
        (2, [255, 0, 255, 255]),
        "the channel that is named"
    );
}

#[test]
fn coats_and_sheen_are_read() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl m\nPc 0.75\nPcr 0.25\nPs 0.5\n");
    let Loaded { scene, notes } = folder.load(face("")).expect("a good file");
    let physical = scene.materials[0].physical.expect("it is lit");
    let coat = physical.coat.expect("a coat");
    assert_eq!((coat.amount, coat.roughness), (0.75, 0.25));
    assert_eq!(physical.sheen.map(|sheen| sheen.colour), Some([0.5; 3]));
    assert!(notes.is_empty(), "{notes:?}");
    folder.write("a.mtl", "newmtl m\nPr 0.5\nPc 0\nPcr 0\nPs 0\n");
    let Loaded { scene, .. } = folder.load(face("")).expect("a good file");
    let physical = scene.materials[0].physical.expect("it is lit");
    assert_eq!((physical.coat, physical.sheen), (None, None), "0 is none");
}

#[test]
fn light_that_is_not_read_is_named() {
    let folder = Folder::new();
    folder.write(
        "a.mtl",
        "newmtl m\nKs 1 1 1\nmap_Ps s.png\nmap_Bump b.png\n",
    );
    let Loaded { scene, notes } = folder.load(face("")).expect("a good file");
    assert!(scene.materials[0].physical.is_none(), "nothing is made up");
    assert!(
        notes.len() == 1 && notes[0].contains("map_Bump, map_Ps") && notes[0].contains("differ"),
        "{notes:?}"
    );
}

#[test]
fn materials_that_no_file_describes_are_named_once() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl other\nKd 1 0 0\n");
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    let faces = "usemtl m\nf 1 2 3\nusemtl n\nf 3 2 1\n";
    for files in ["mtllib a.mtl\n", ""] {
        let Loaded { notes, .. } = folder
            .load(format!("{files}{square}{faces}"))
            .expect("a good file");
        assert!(
            notes.len() == 1 && notes[0].contains("'m'") && notes[0].contains("plain"),
            "{notes:?}"
        );
    }
    let Loaded { notes, .. } = folder
        .load(format!("mtllib none.mtl\n{square}{faces}"))
        .expect("a good file");
    assert!(
        notes.len() == 1 && notes[0].contains("none.mtl"),
        "one note for a file that is missing: {notes:?}"
    );
}

#[test]
fn elements_that_are_no_polygons_are_left_out_with_a_note() {
    let polygon = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    let elements = [
        ("l 1 2\n", "points and lines"),
        ("p 1\n", "points and lines"),
        ("curv 0 1 1 2\n", "free-form surfaces"),
        ("curv2 1 2\n", "free-form surfaces"),
        ("surf 0 1 0 1 1 2 3\n", "free-form surfaces"),
    ];
    for (line, kind) in elements {
        let Loaded { scene, notes } = Folder::new()
            .load(format!("{polygon}{line}"))
            .expect("a good file");
        assert_eq!(scene.meshes[0].triangles.len(), 1, "{line}");
        assert!(
            notes.iter().any(|note| note.contains(kind)),
            "{line}{notes:?}"
        );
    }
}
