//! Material files: what is missing, what is named often, and the words of physically based materials.

use resample_io::Gate;

use super::{Folder, SQUARE};
use crate::input::{LoadOptions, Loaded, Unreadable, load};
use crate::scene::{Scene, Texels};

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
fn light_that_is_not_read_is_named() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl m\nKs 1 1 1\nPs 0.5\nmap_Bump b.png\n");
    let Loaded { scene, notes } = folder.load(face("")).expect("a good file");
    assert!(scene.materials[0].physical.is_none(), "nothing is made up");
    assert!(
        notes.len() == 1 && notes[0].contains("Ps, map_Bump") && notes[0].contains("differ"),
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
