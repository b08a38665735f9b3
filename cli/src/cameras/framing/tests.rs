//! Volumes stand upright, as their files and the options want it.

use glam::{DAffine3, DVec3};
use volsplat::Volume;
use volsplat::volume::Voxels;

use super::volume::stance;
use super::*;
use crate::values::{Orbit, Size};
use volsplat::Described;

const BOX: [DVec3; 2] = [DVec3::new(10.0, -4.0, 3.0), DVec3::new(14.0, 2.0, 5.0)];

fn view(lens: Lens) -> View {
    let stance = Stance {
        up: DVec3::Y,
        right: DVec3::X,
    };
    View {
        size: Size {
            width: 200,
            height: 100,
        },
        orbit: DEFAULT_ORBIT,
        stance,
        lens,
    }
}

fn volume() -> Volume {
    let world_from_index = DAffine3::from_translation(DVec3::new(5.0, 6.0, 7.0));
    Volume::new([2, 3, 4], Voxels::U8(vec![0; 24]), world_from_index).expect("a good volume")
}

#[test]
fn azimuth_zero_looks_along_the_front_axis() {
    for (up, forward) in [
        (DVec3::Y, DVec3::NEG_Z),
        (DVec3::NEG_Y, DVec3::Z),
        (DVec3::Z, DVec3::Y),
        (DVec3::NEG_Z, DVec3::NEG_Y),
        (DVec3::X, DVec3::Z),
        (DVec3::NEG_X, DVec3::NEG_Z),
    ] {
        let orbit = Orbit {
            azimuth_deg: 0.0,
            elevation_deg: 0.0,
            distance: 1.0,
        };
        let stance = stance(&volume(), Some(up));
        let camera = frame(
            &Extent::of_box(BOX),
            &View {
                orbit,
                stance,
                ..view(Lens::Orthographic)
            },
        )
        .expect("a good view");
        assert!(
            (camera.forward_in_world() - forward).length() < 1e-12,
            "up {up}"
        );
        let up_in_camera = camera.camera_from_world.transform_vector3(up);
        assert!(
            (up_in_camera - DVec3::NEG_Y).length() < 1e-12,
            "up {up} must be up in the picture"
        );
    }
}

#[test]
fn a_patient_is_seen_from_the_front_in_either_convention() {
    let mut patient = volume();
    patient.up_hint = Some(DVec3::Z);
    for (space, face) in [
        ("left-posterior-superior", DVec3::NEG_Y),
        ("right-anterior-superior", DVec3::Y),
    ] {
        patient.space = Some(space.to_owned());
        let Stance { up, right } = stance(&patient, None);
        assert_eq!((up, right.cross(up)), (DVec3::Z, face), "{space}");
    }
    assert_eq!(
        stance(&patient, Some(DVec3::NEG_Y)).up,
        DVec3::NEG_Y,
        "what is asked for wins over the file"
    );
}

#[test]
fn grid_box_reaches_from_the_first_to_the_last_voxel() {
    assert_eq!(
        volume().lattice().bounds_in_world(),
        [DVec3::new(5.0, 6.0, 7.0), DVec3::new(6.0, 8.0, 10.0)],
        "2 x 3 x 4 voxels"
    );
    let mut mirrored = volume();
    mirrored.world_from_index.matrix3.x_axis = DVec3::NEG_X;
    let expected = [DVec3::new(4.0, 6.0, 7.0), DVec3::new(5.0, 8.0, 10.0)];
    assert_eq!(
        mirrored.lattice().bounds_in_world(),
        expected,
        "corners stay sorted when an axis is mirrored"
    );
}
