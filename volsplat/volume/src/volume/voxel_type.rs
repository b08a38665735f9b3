//! The scalar types and byte orders that files are stored in, and the names that people and formats give them.

use std::str::FromStr;

use crate::volume::Voxels;

/// Type of one stored scalar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VoxelType {
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 64 bits; held as f64, so values beyond 2^53 are rounded.
    U64,
    /// Signed, 64 bits; held as f64, so values beyond 2^53 are rounded.
    I64,
    /// IEEE single.
    F32,
    /// IEEE double.
    F64,
}

/// Order of the bytes of one scalar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Endian {
    /// Least significant byte first.
    #[default]
    Little,
    /// Most significant byte first.
    Big,
}

#[cfg(feature = "input")]
impl Endian {
    /// A whole number of 16 bits.
    pub(crate) fn number_16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Little => u16::from_le_bytes(bytes),
            Self::Big => u16::from_be_bytes(bytes),
        }
    }

    /// A whole number of 32 bits.
    pub(crate) fn number_32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Self::Little => u32::from_le_bytes(bytes),
            Self::Big => u32::from_be_bytes(bytes),
        }
    }
}

/// Every accepted name, lower case; the first of each type is its own. Those with words are the ones of NRRD and C.
const NAMES: [(VoxelType, &[&str]); 10] = [
    (
        VoxelType::U8,
        &["u8", "uint8", "uchar", "unsigned char", "uint8_t", "byte"],
    ),
    (
        VoxelType::I8,
        &["i8", "int8", "signed char", "char", "schar", "int8_t"],
    ),
    (
        VoxelType::U16,
        &[
            "u16",
            "uint16",
            "ushort",
            "unsigned short",
            "unsigned short int",
            "uint16_t",
        ],
    ),
    (
        VoxelType::I16,
        &[
            "i16",
            "int16",
            "short",
            "short int",
            "signed short",
            "signed short int",
            "int16_t",
        ],
    ),
    (
        VoxelType::U32,
        &[
            "u32",
            "uint32",
            "uint",
            "unsigned int",
            "unsigned",
            "uint32_t",
        ],
    ),
    (
        VoxelType::I32,
        &["i32", "int32", "int", "signed int", "int32_t"],
    ),
    (
        VoxelType::U64,
        &[
            "u64",
            "uint64",
            "ulonglong",
            "unsigned long long",
            "unsigned long long int",
            "uint64_t",
        ],
    ),
    (
        VoxelType::I64,
        &[
            "i64",
            "int64",
            "longlong",
            "long long",
            "long long int",
            "signed long long",
            "signed long long int",
            "int64_t",
        ],
    ),
    (VoxelType::F32, &["f32", "float32", "float", "single"]),
    (VoxelType::F64, &["f64", "float64", "double"]),
];

impl VoxelType {
    /// The type in which voxels are held; 64-bit integers are held as f64.
    pub fn of(voxels: &Voxels) -> Self {
        match voxels {
            Voxels::U8(_) => Self::U8,
            Voxels::I8(_) => Self::I8,
            Voxels::U16(_) => Self::U16,
            Voxels::I16(_) => Self::I16,
            Voxels::U32(_) => Self::U32,
            Voxels::I32(_) => Self::I32,
            Voxels::F32(_) => Self::F32,
            Voxels::F64(_) => Self::F64,
        }
    }

    /// Bytes of one scalar: 1, 2, 4 or 8.
    ///
    /// ```
    /// use resample_volume::VoxelType;
    ///
    /// assert_eq!(VoxelType::U16.bytes(), 2);
    /// assert_eq!("f32".parse(), Ok(VoxelType::F32));
    /// ```
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The short name, such as "u16".
    pub fn name(self) -> &'static str {
        NAMES
            .iter()
            .find(|(kind, _)| *kind == self)
            .map_or("", |(_, names)| names[0])
    }
}

impl FromStr for VoxelType {
    type Err = String;

    /// Case and repeated spaces do not matter. The error lists the short names.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = text
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
            .to_lowercase();
        let found = NAMES
            .iter()
            .find(|(_, names)| names.contains(&wanted.as_str()));
        found.map(|(kind, _)| *kind).ok_or_else(|| {
            let short: Vec<_> = NAMES.iter().map(|(_, names)| names[0]).collect();
            format!(
                "unknown voxel type '{text}': expected one of {}",
                short.join(", ")
            )
        })
    }
}

impl FromStr for Endian {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().to_lowercase().as_str() {
            "little" => Ok(Self::Little),
            "big" => Ok(Self::Big),
            _ => Err(format!(
                "unknown byte order '{text}': expected little or big"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_gives_its_type_in_any_case() {
        for (kind, names) in NAMES {
            for name in names {
                assert_eq!(name.to_uppercase().parse(), Ok(kind), "{name}");
            }
            assert_eq!(kind.name(), names[0]);
        }
        assert_eq!(
            "unsigned   short".parse(),
            Ok(VoxelType::U16),
            "spaces do not matter"
        );
    }

    #[test]
    fn unknown_names_list_the_known_ones() {
        let text = "u12".parse::<VoxelType>().expect_err("u12 is no type");
        assert!(
            text.contains("u12") && text.contains("u8, i8, u16"),
            "{text}"
        );
        assert!("middle".parse::<Endian>().is_err());
        assert_eq!(" BIG".parse(), Ok(Endian::Big));
    }
}
