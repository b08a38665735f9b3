//! Streams that the program meshoptimizer 1.3.0 wrote of numbers made here, and streams of an encoder of our own.

use super::*;

fn bytes(hex: &str) -> Vec<u8> {
    let digit = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
    (0..hex.len()).step_by(2).map(digit).collect()
}

fn layout(mode: Mode, count: usize, stride: usize, filter: Filter) -> Layout {
    Layout {
        mode,
        count,
        stride,
        filter,
    }
}

/// Of a grid of 5 x 4 vertices in rows, and of three triangles far away.
const TRIANGLES: &str = "e1fe1e100e100e100ece1e160e150e140ece1e140e140e140effffff0f0aefaa0f90b60832d9c508ff2021ce0f0076875667\
     78a9866589689801690000";

#[test]
fn triangles_are_those_that_were_written() {
    let mut corners = Vec::new();
    for cell in (0..3).flat_map(|row| (0..4).map(move |column| 5 * row + column)) {
        corners.extend([cell, cell + 1, cell + 5]);
        corners.extend([cell + 1, cell + 6, cell + 5]);
    }
    corners.extend([1000, 3, 70_000, 3, 19, 1000, 19, 2, 1001]);
    let found = indices::triangles(&bytes(TRIANGLES), corners.len()).expect("a whole stream");
    // The format may begin a triangle with another of its corners.
    let least_first = |corners: &[u32]| {
        let mut triangle = [corners[0], corners[1], corners[2]];
        let least = (0..3).min_by_key(|&at| triangle[at]).unwrap_or(0);
        triangle.rotate_left(least);
        triangle
    };
    let turned = |list: &[u32]| list.chunks(3).map(least_first).collect::<Vec<_>>();
    assert_eq!(turned(&found), turned(&corners), "each triangle, in order");
}

const INDICES: &str = "d100140e140e911c04050405ecff0f971c00000000";

#[test]
fn indices_are_those_that_were_written() {
    let expected = [0, 5, 1, 6, 2, 900, 3, 901, 4, 902, 65535, 0u32];
    let found = layout(Mode::Indices, 12, 2, Filter::None).decode(&bytes(INDICES));
    let found = found.expect("a whole stream");
    let words = found
        .chunks(2)
        .map(|word| u32::from(word[0]) + 256 * u32::from(word[1]));
    assert_eq!(words.collect::<Vec<_>>(), expected, "two runs in turn");
}

/// 20 elements of 8 bytes: a ramp of 16 bits, squares, a constant, two bytes and two of three bits of noise.
const ELEMENTS: &str = "00000007d3a706002c010107c23e06055802040720af03048403090726520303b0041007e6bb0206dc0519079f5a02030807\
     2407aab90602340831079602030060094007cc1f02068c0a5107b2970202b80b640727fc0705e40c7907da900602100e9007\
     d97305033c0fa9074f8205046810c40747af00079411e107098a0003c0120007463e0500ec1321073a2701001815440779e5\
     050644166907027a0405";
const VERSION_0: &str = "a00700585858585858585858585858585858ff00000058585858052aaeaaea0404ae00000004070002060a0e12161a1e2226\
     2a2e32363aff0000003e42464a00070021bc0c7f8d16276c33ea9901ec0f7bff0000007a177eed0700d1e2b9d2c1be923af0\
     cad7391e5a49ff000000972d83d5060050108510a11090fd0000000a0708060a116513c7652267cd000000050c0000000000\
     0000000000000000000000000000000000000000000007d3a70600";
const VERSION_1: &str = "a1375f0058585858585858585858585858585858585858052aaaaaaaaa0000000002060a0e12161a1e22262a2e32363ac142\
     464a040100010021bc0c7f8d16276c33ea9901ec0f7b7a177eed00d1e2b9d2c1be923af0cad7391e5a49972d83d502005010\
     8510a110900f000a070801020a116513c76522670d00050c01000000000000000000000000000000000007d3a706000100";
const VERSION_1_FAST: &str = "a1955503005858585858585858585858585858580f0058585858052aaeaaea0404ae00000004030002060a0e12161a1e2226\
     2a2e32363a0f003e42464a030021bc0c7f8d16276c33ea9901ec0f7b0f007a177eed0300d1e2b9d2c1be923af0cad7391e5a\
     490f00972d83d5020050108510a110900f000a070801020a116513c76522670d00050c010000000000000000000000000000\
     00000007d3a706000000";

#[test]
fn attributes_are_those_that_were_written() {
    for stream in [VERSION_0, VERSION_1, VERSION_1_FAST] {
        let found = layout(Mode::Attributes, 20, 8, Filter::None).decode(&bytes(stream));
        assert_eq!(found.as_deref(), Ok(bytes(ELEMENTS).as_slice()), "{stream}");
    }
}

/// 24 pairs of floats, the second by exclusive or.
const FLOATS: &str = "a13f7a006500656666cbcdcbcdcb65656765656565676565cccecc006600666666cccccccccc66666666666666666666cccc\
     cc0098009a66683234323434181a1a1a1a181a1a1a1a0c0c0e0106007b0100020a3a12f10d153111752d19e93d6521e1257d\
     29d96d350020000702000100000000000000000000000000000000000000007a440132";

#[test]
fn floats_are_those_that_were_written() {
    let found = layout(Mode::Attributes, 24, 8, Filter::None).decode(&bytes(FLOATS));
    let expected = (0..24u8).flat_map(|i| [f64::from(i) * 0.1, 1000.0 + f64::from(i).powi(2)]);
    let expected: Vec<u8> = expected
        .flat_map(|number| (number as f32).to_le_bytes())
        .collect();
    assert_eq!(found, Ok(expected), "each float to the bit");
}

#[test]
fn directions_come_out_of_the_octahedron() {
    const SMALL: &str = "27007f81db227f7f06ba7f812a367f7fa8f07f8149d17f7fdf667f81c7a57f7f663a7f8199457f7f50977f815d747f7f";
    const LARGE: &str = "6d020000ff070180affd1f02ff07ff7f630094fbff0701809d026903ff07ff7f72fa04ffff0701809c0412fdff07ff7fe7fd\
     6906ff0701806cfc4cfaff07ff7f6b06af03ff07018083f95804ff07ff7f0f0561f9ff070180d8055207ff07ff7f";
    // The largest error of an octahedron of that many steps, in units of the largest number, and the rounding of the result.
    for (stored, stride, most, error) in [(SMALL, 4, 127.0, 1.6), (LARGE, 8, 32767.0, 33.0)] {
        let mut found = bytes(stored);
        Filter::Octahedral
            .apply(&mut found, stride)
            .expect("its size");
        for (i, element) in (0..12u8).map(f64::from).zip(found.chunks(stride)) {
            let z = 1.0 - 2.0 * (i + 0.5) / 12.0;
            let (sin, cos) = (2.4 * i).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            let expected = [radius * cos, radius * sin, z];
            for (expected, bytes) in expected.iter().zip(element.chunks(stride / 4)) {
                let found = match *bytes {
                    [byte] => f64::from(byte.cast_signed()),
                    _ => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
                };
                assert!(
                    (found - expected * most).abs() <= error,
                    "direction {i}: {found} for {}",
                    expected * most
                );
            }
        }
    }
}

#[test]
fn quaternions_get_their_largest_number_back() {
    let mut found = bytes(
        "c31b45f20000fd1f98e7120cf315ff1fa7eb7414a7ebfc1f8fea2e0b9005fd1fade5f0fa9d0eff1f2c19a30862e9fc1f6d07\
     caf827f2fd1fbbe588fa5b00ff1f",
    );
    Filter::Quaternion.apply(&mut found, 8).expect("its size");
    for (i, element) in (0..8u8).map(f64::from).zip(found.chunks(8)) {
        let numbers = [
            i.sin(),
            (2.0 * i).cos(),
            (3.0 * i + 1.0).sin(),
            (i + 2.0).cos(),
        ];
        let length = numbers.iter().map(|n| n * n).sum::<f64>().sqrt();
        let found: Vec<f64> = element
            .chunks(2)
            .map(|word| f64::from(i16::from_le_bytes([word[0], word[1]])) / 32767.0)
            .collect();
        // Both signs are one rotation. Numbers have 14 bits, of a range of the root of 2.
        let dot: f64 = found.iter().zip(numbers).map(|(a, b)| a * b / length).sum();
        for (found, number) in found.iter().zip(numbers) {
            let expected = number / length * dot.signum();
            assert!((found - expected).abs() < 2e-4, "{found} for {expected}");
        }
    }
}

#[test]
fn floats_get_their_exponent_back() {
    let mut found = bytes(
        "278ef8e64f78fbe802c9fae9538cfaeab660fbeb9a99f9ea9a9905ed9a1905f0331306f2663e06f4cdf205f61a6905f8",
    );
    Filter::Exponential.apply(&mut found, 4).expect("its size");
    for (i, bytes) in (0..12u8).map(f64::from).zip(found.as_chunks().0) {
        let (found, expected) = (
            f64::from(f32::from_le_bytes(*bytes)),
            (i - 5.3) * 3f64.powf(i - 6.0),
        );
        // Mantissas of 20 bits with their sign.
        assert!(
            (found / expected - 1.0).abs() < 4e-6,
            "{found} for {expected}"
        );
    }
}

#[test]
fn colours_come_back() {
    const SMALL: &str = "0000009589d5ffaa502abdc057ff3cd560d4bbeaa728faff";
    const LARGE: &str = "00000000000055098f0848fdecffaa0a0005a302cefb000c7a05ecffcc03550df60534fda4fbaa0e7a0a8f029affff0f";
    // Three numbers of 8 or 12 bits, each rounded, make a colour.
    for (stored, stride, error) in [(SMALL, 4, 2.0 / 255.0), (LARGE, 8, 2.0 / 4095.0)] {
        let mut found = bytes(stored);
        Filter::Colour.apply(&mut found, stride).expect("its size");
        for (i, element) in (0..6u32).zip(found.chunks(stride)) {
            let part = |times: u32| f64::from(i * times % 101) / 100.0;
            let expected = [part(37), part(53), part(71), f64::from(i + 1) / 6.0];
            for (expected, bytes) in expected.iter().zip(element.chunks(stride / 4)) {
                let found = match *bytes {
                    [byte] => f64::from(byte) / 255.0,
                    _ => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0,
                };
                assert!(
                    (found - expected).abs() <= error,
                    "colour {i}: {found} for {expected}"
                );
            }
        }
    }
}

/// Numbers without a pattern.
struct Noise(u32);

impl Noise {
    fn next(&mut self, below: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % below
    }
}

/// A stream of version 1 with channels, controls and widths in turn, of which each can hold its differences.
fn encoded(elements: &[u8], stride: usize, channels: &[u8], noise: &mut Noise) -> Vec<u8> {
    let mut stream = vec![0xa1];
    let mut previous = elements[..stride].to_vec();
    let first = previous.clone();
    for block in elements.chunks((8192 / stride / 16 * 16).min(256) * stride) {
        let count = block.len() / stride;
        let mut planes = vec![vec![0; count.next_multiple_of(16)]; stride];
        for (at, element) in block.chunks(stride).enumerate() {
            for (channel, &code) in channels.iter().enumerate() {
                let four = |of: &[u8]| [0, 1, 2, 3].map(|byte| of[4 * channel + byte]);
                let (now, before) = (four(element), four(&previous));
                let zigzag = |d: i32, bits: u32| ((d << 1) ^ (d >> (bits - 1))).cast_unsigned();
                let difference = match code & 3 {
                    0 => [0, 1, 2, 3].map(|byte: usize| {
                        let d = now[byte].wrapping_sub(before[byte]).cast_signed();
                        zigzag(i32::from(d), 8).to_le_bytes()[0]
                    }),
                    1 => {
                        let word = |of: [u8; 4], i: usize| i16::from_le_bytes([of[i], of[i + 1]]);
                        let half = |i| {
                            let d = word(now, i).wrapping_sub(word(before, i));
                            zigzag(i32::from(d), 16).to_le_bytes()
                        };
                        [half(0)[0], half(0)[1], half(2)[0], half(2)[1]]
                    }
                    _ => (u32::from_le_bytes(now) ^ u32::from_le_bytes(before))
                        .rotate_left(u32::from(code >> 4))
                        .to_le_bytes(),
                };
                for (byte, difference) in difference.into_iter().enumerate() {
                    planes[4 * channel + byte][at] = difference;
                }
            }
            previous.copy_from_slice(element);
        }
        let controls: Vec<u8> = planes
            .iter()
            .map(|plane| match plane.iter().all(|&d| d == 0) {
                true => 2,
                false => [0, 1, 3][noise.next(3) as usize],
            })
            .collect();
        stream.extend(
            controls
                .chunks(4)
                .map(|c| c[0] | c[1] << 2 | c[2] << 4 | c[3] << 6),
        );
        for (plane, control) in planes.iter().zip(controls) {
            match control {
                2 => {}
                3 => stream.extend(&plane[..count]),
                _ => stream.extend(written_plane(plane, control, noise)),
            }
        }
    }
    let tail = [first.as_slice(), channels].concat();
    stream.resize(stream.len() + 24usize.saturating_sub(tail.len()), 0);
    stream.extend(tail);
    stream
}

/// A plane whose groups have widths by chance.
fn written_plane(plane: &[u8], control: u8, noise: &mut Noise) -> Vec<u8> {
    let widths: [u32; 4] = if control == 0 {
        [0, 1, 2, 4]
    } else {
        [1, 2, 4, 8]
    };
    let groups = plane.len() / 16;
    let (mut header, mut body) = (vec![0; groups.div_ceil(4)], Vec::new());
    for (index, group) in plane.chunks(16).enumerate() {
        let mut code = noise.next(4) as usize;
        if widths[code] == 0 && group.iter().any(|&d| d != 0) {
            code = 1;
        }
        header[index / 4] |= u8::try_from(code << (index % 4 * 2)).expect("two bits");
        let width = widths[code];
        if width == 8 {
            body.extend(group);
        } else if width > 0 {
            let escape = (1u8 << width) - 1;
            let mut codes = vec![0u8; 2 * width as usize];
            for (place, &difference) in group.iter().enumerate() {
                let bit = place * width as usize;
                let shift = if width == 1 {
                    bit % 8
                } else {
                    8 - width as usize - bit % 8
                };
                codes[bit / 8] |= difference.min(escape) << shift;
            }
            body.extend(codes);
            body.extend(group.iter().filter(|&&difference| difference >= escape));
        }
    }
    [header, body].concat()
}

#[test]
fn every_channel_and_width_comes_back() {
    let mut noise = Noise(7);
    for round in 0..200 {
        let stride = 4 * (1 + noise.next(20) as usize);
        let count = 1 + noise.next(600) as usize;
        let mut elements = vec![0u8; count * stride];
        // Steps of all sizes, so that all widths are met.
        let steps: Vec<u32> = (0..stride)
            .map(|_| [1, 2, 5, 30, 256][noise.next(5) as usize])
            .collect();
        for at in stride..elements.len() {
            let step = noise.next(steps[at % stride]).to_le_bytes()[0];
            elements[at] = elements[at - stride].wrapping_add(step);
        }
        let channels: Vec<u8> = (0..stride / 4)
            .map(|_| [0, 1, 2, 0x32, 0xf2][noise.next(5) as usize])
            .collect();
        let stream = encoded(&elements, stride, &channels, &mut noise);
        let found = layout(Mode::Attributes, count, stride, Filter::None).decode(&stream);
        assert!(
            found == Ok(elements),
            "round {round}: {count} elements of {stride} bytes"
        );
    }
}

#[test]
fn damaged_streams_are_refused() {
    let whole = [
        (layout(Mode::Triangles, 81, 4, Filter::None), TRIANGLES),
        (layout(Mode::Indices, 12, 4, Filter::None), INDICES),
        (layout(Mode::Attributes, 20, 8, Filter::None), VERSION_0),
        (layout(Mode::Attributes, 20, 8, Filter::None), VERSION_1),
        (layout(Mode::Attributes, 24, 8, Filter::None), FLOATS),
    ];
    for (layout, hex) in whole {
        let stream = bytes(hex);
        assert!(layout.decode(&stream).is_ok(), "{hex} is whole");
        for length in 0..stream.len() {
            assert!(
                layout.decode(&stream[..length]).is_err(),
                "{hex} cut to {length} bytes"
            );
        }
        let longer = [&stream[..2], &stream[1..]].concat();
        assert!(
            layout.decode(&longer).is_err(),
            "{hex} with a byte too many"
        );
        let other = [&[0x5a], &stream[1..]].concat();
        assert!(layout.decode(&other).is_err(), "{hex} with another mark");
    }
}

#[test]
fn layouts_that_no_stream_has_are_refused() {
    for (mode, count, stride, filter) in [
        (Mode::Attributes, 4, 0, Filter::None),
        (Mode::Attributes, 4, 6, Filter::None),
        (Mode::Attributes, 4, 260, Filter::None),
        (Mode::Attributes, usize::MAX, 8, Filter::None),
        (Mode::Triangles, 4, 4, Filter::None),
        (Mode::Triangles, 3, 3, Filter::None),
        (Mode::Indices, 3, 8, Filter::None),
        (Mode::Indices, 3, 4, Filter::Octahedral),
    ] {
        let layout = layout(mode, count, stride, filter);
        assert!(layout.bytes().is_err(), "{layout:?}");
    }
    let mut elements = vec![0; 12];
    for filter in [Filter::Octahedral, Filter::Quaternion, Filter::Colour] {
        assert!(
            filter.apply(&mut elements, 12).is_err(),
            "{filter:?} of 12 bytes"
        );
    }
}
