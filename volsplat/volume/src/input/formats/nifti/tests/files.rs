//! NIfTI files of a few voxels, of both versions and byte orders.

use crate::input::test_files::Folder;
use crate::volume::Volume;

/// The fields of a header that a test changes; the image has 2x1x2 voxels unless it says otherwise.
#[derive(Clone, Copy)]
pub(crate) struct Fields {
    pub(crate) version: u8,
    pub(crate) is_big: bool,
    pub(crate) dim: [i64; 8],
    pub(crate) datatype: i16,
    pub(crate) pixdim: [f64; 8],
    pub(crate) vox_offset: f64,
    pub(crate) slope: f64,
    pub(crate) inter: f64,
    pub(crate) codes: [i16; 2],
    pub(crate) quaternion: [f64; 6],
    pub(crate) srow: [f64; 12],
    pub(crate) is_pair: bool,
}

impl Fields {
    pub(crate) fn new(version: u8, datatype: i16) -> Self {
        Self {
            version,
            is_big: false,
            dim: [3, 2, 1, 2, 0, 0, 0, 0],
            datatype,
            pixdim: [1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0],
            vox_offset: if version == 1 { 352.0 } else { 544.0 },
            slope: 0.0,
            inter: 0.0,
            codes: [0, 0],
            quaternion: [0.0; 6],
            srow: [0.0; 12],
            is_pair: false,
        }
    }

    /// The header and the four bytes that say that no extension follows.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let length: usize = if self.version == 1 { 348 } else { 540 };
        let mut head = Head {
            bytes: vec![0; length + 4],
            is_big: self.is_big,
        };
        head.put(0, &(length as u32).to_be_bytes());
        let (kind, version) = (if self.is_pair { b'i' } else { b'+' }, b'0' + self.version);
        let mark = [b'n', kind, version, 0];
        if self.version == 1 {
            head.bytes[344..348].copy_from_slice(&mark);
            head.bytes[38] = b'r';
            (0..8).for_each(|axis| head.put(40 + 2 * axis, &(self.dim[axis] as i16).to_be_bytes()));
            head.put(70, &self.datatype.to_be_bytes());
            head.floats(76, &self.pixdim);
            head.floats(108, &[self.vox_offset, self.slope, self.inter]);
            head.put(252, &self.codes[0].to_be_bytes());
            head.put(254, &self.codes[1].to_be_bytes());
            head.floats(256, &self.quaternion);
            head.floats(280, &self.srow);
        } else {
            head.bytes[4..8].copy_from_slice(&mark);
            head.bytes[8..12].copy_from_slice(b"\r\n\x1a\n");
            head.put(12, &self.datatype.to_be_bytes());
            (0..8).for_each(|axis| head.put(16 + 8 * axis, &self.dim[axis].to_be_bytes()));
            head.doubles(104, &self.pixdim);
            head.put(168, &(self.vox_offset as i64).to_be_bytes());
            head.doubles(176, &[self.slope, self.inter]);
            head.put(344, &i32::from(self.codes[0]).to_be_bytes());
            head.put(348, &i32::from(self.codes[1]).to_be_bytes());
            head.doubles(352, &self.quaternion);
            head.doubles(400, &self.srow);
        }
        head.bytes
    }

    pub(crate) fn load(&self, data: &[u8]) -> Volume {
        Folder::new()
            .load(&[&self.bytes(), data])
            .unwrap_or_else(|error| panic!("{error}"))
    }

    pub(crate) fn refusal(&self, data: &[u8]) -> String {
        Folder::new().refusal(&[&self.bytes(), data])
    }
}

struct Head {
    bytes: Vec<u8>,
    is_big: bool,
}

impl Head {
    /// Writes a number given most significant byte first.
    fn put(&mut self, at: usize, number: &[u8]) {
        let mut number = number.to_vec();
        if !self.is_big {
            number.reverse();
        }
        self.bytes[at..at + number.len()].copy_from_slice(&number);
    }

    fn floats(&mut self, at: usize, values: &[f64]) {
        values
            .iter()
            .enumerate()
            .for_each(|(i, &v)| self.put(at + 4 * i, &(v as f32).to_be_bytes()));
    }

    fn doubles(&mut self, at: usize, values: &[f64]) {
        values
            .iter()
            .enumerate()
            .for_each(|(i, &v)| self.put(at + 8 * i, &v.to_be_bytes()));
    }
}
