//! Volumes on other grids than the first: PET over CT, a coarser mask.

use super::{Bench, assert_good, stderr};

/// A volume of floats in a patient's space: dimensions, spacing, origin, and the value at a place in the world.
fn nrrd(
    space: &str,
    [nx, ny, nz]: [usize; 3],
    spacing: f64,
    origin: [f64; 3],
    value: impl Fn([f64; 3]) -> f32,
) -> Vec<u8> {
    let [x, y, z] = origin;
    let mut file = format!(
        "NRRD0005\ntype: float\ndimension: 3\nspace: {space}\nsizes: {nx} {ny} {nz}\nspace directions: ({spacing},0,0) (0,{spacing},0) \
         (0,0,{spacing})\nspace origin: ({x},{y},{z})\nendian: little\nencoding: raw\n\n"
    )
    .into_bytes();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let at = [i, j, k].map(|n| spacing * n as f64);
                let at = [0, 1, 2].map(|axis| origin[axis] + at[axis]);
                file.extend(value(at).to_le_bytes());
            }
        }
    }
    file
}

/// A function of the place that is linear, so that trilinear values of any grid are exact.
fn ramp([x, y, z]: [f64; 3]) -> f32 {
    (10.0 + x + 0.5 * y + 0.25 * z) as f32
}

const LPS: &str = "left-posterior-superior";

#[test]
fn a_coarser_volume_in_another_patients_space_is_resampled() {
    let bench = Bench::new();
    let ball = |[x, y, z]: [f64; 3]| {
        let far = (x - 8.0).powi(2) + (y - 8.0).powi(2) + (z - 8.0).powi(2);
        if far < 36.0 { 100.0 } else { 0.0 }
    };
    bench.write("ct.nrrd", &nrrd(LPS, [16; 3], 1.0, [0.0; 3], ball));
    bench.write("same.nrrd", &nrrd(LPS, [16; 3], 1.0, [0.0; 3], ramp));
    // Right and anterior are the other way round.
    let turned = |[x, y, z]: [f64; 3]| ramp([-x, -y, z]);
    let pet = nrrd(
        "right-anterior-superior",
        [12; 3],
        2.0,
        [-20.0, -20.0, -4.0],
        turned,
    );
    bench.write("pet.nrrd", &pet);
    let words = "volsplat ct.nrrd --window 50,100 --size 60x50 --also";
    for (file, picture) in [("same.nrrd", "same.png"), ("pet.nrrd", "pet.png")] {
        let output = bench.run(&format!("{words} {file} magma -o out/{picture}"));
        assert_good(&output);
        let said = stderr(&output);
        assert_eq!(
            said.contains("note: pet.nrrd lies on another grid: resampled to that of ct.nrrd"),
            file == "pet.nrrd",
            "{said}"
        );
    }
    let picture = |name: &str| {
        image::open(bench.path("out").join(name))
            .expect("a picture")
            .to_rgba8()
    };
    let (same, pet) = (picture("same.png"), picture("pet.png"));
    // The least and the greatest value, between which the colours lie, are those of each file.
    let mut differ = 0;
    for (a, b) in same.pixels().zip(pet.pixels()) {
        differ += usize::from(a.0[3].abs_diff(b.0[3]) > 40);
    }
    assert!(differ < 60, "{differ} pixels of another opacity");
    let output = bench.run(&format!("{words} same.nrrd #ff0000:5,40 -o out/a.png"));
    assert_good(&output);
    let output = bench.run(&format!("{words} pet.nrrd #ff0000:5,40 -o out/b.png"));
    assert_good(&output);
    let (a, b) = (picture("a.png"), picture("b.png"));
    let most = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(most <= Some(1), "{most:?} of 255");
}

#[test]
fn a_mask_on_another_grid_hides_by_its_nearest_voxels() {
    let bench = Bench::new();
    bench.write("ct.nrrd", &nrrd(LPS, [16; 3], 1.0, [0.0; 3], |_| 100.0));
    let half = |[x, _, _]: [f64; 3]| if x < 7.9 { 0.0 } else { 1.0 };
    bench.write("fine.nrrd", &nrrd(LPS, [16; 3], 1.0, [0.0; 3], half));
    bench.write("coarse.nrrd", &nrrd(LPS, [8; 3], 2.0, [0.5; 3], half));
    for name in ["fine", "coarse"] {
        let words = "volsplat ct.nrrd --window 50,100 --size 60x50 --mask";
        assert_good(&bench.run(&format!("{words} {name}.nrrd -o out/{name}.png")));
    }
    let bytes = |name: &str| std::fs::read(bench.path("out").join(name)).expect("a picture");
    assert!(bytes("fine.png") == bytes("coarse.png"));
}

#[test]
fn volumes_with_nothing_in_common_are_refused() {
    let bench = Bench::new();
    bench.write("ct.nrrd", &nrrd(LPS, [8; 3], 1.0, [0.0; 3], ramp));
    bench.write("far.nrrd", &nrrd(LPS, [8; 3], 1.0, [500.0; 3], ramp));
    let output = bench.run("volsplat ct.nrrd --also far.nrrd red -o out/a.png");
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(
        said.contains("far.nrrd: it lies nowhere inside the other volume"),
        "{said}"
    );
    assert_eq!(bench.written(), Vec::<String>::new());
}
