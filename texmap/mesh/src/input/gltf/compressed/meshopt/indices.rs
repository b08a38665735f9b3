//! Triangles and lists of indices.
//!
//! A triangle is a byte: an edge of the last sixteen and the third corner, or three corners. A corner is the next one that is
//! new, one of the last sixteen, or a difference from the last that was written out.
//! Source: `KHR_meshopt_compression`, "Mode 1: triangles" and "Mode 2: indices".

use crate::input::gltf::compressed::meshopt::stream::{Stream, signed};

/// Bytes of the table of pairs of corners at the end of a stream.
const TABLE: usize = 16;

/// The last of some things; the newest has number 0.
struct Last<T> {
    ring: [T; 16],
    next: usize,
}

impl<T: Copy + Default> Last<T> {
    fn new() -> Self {
        Self {
            ring: [T::default(); 16],
            next: 0,
        }
    }

    fn get(&self, number: u8) -> T {
        self.ring[(self.next + 15 - usize::from(number)) % 16]
    }

    fn push(&mut self, thing: T) {
        self.ring[self.next] = thing;
        self.next = (self.next + 1) % 16;
    }
}

/// The state between triangles.
struct Corners<'a> {
    numbers: Stream<'a>,
    /// The corner that was not there before.
    new: u32,
    /// The last corner that was written out.
    written: u32,
    corners: Last<u32>,
    edges: Last<[u32; 2]>,
}

impl Corners<'_> {
    fn next_new(&mut self) -> u32 {
        let corner = self.new;
        self.new = corner.wrapping_add(1);
        corner
    }

    fn next_written(&mut self) -> Result<u32, String> {
        let difference = signed(self.numbers.number()?);
        self.written = self.written.wrapping_add(difference);
        Ok(self.written)
    }

    /// A corner by four bits of a code, and whether it is a new one.
    fn by_code(&mut self, code: u8, may_be_written: bool) -> Result<(u32, bool), String> {
        match code {
            0 => Ok((self.next_new(), true)),
            15 if may_be_written => Ok((self.next_written()?, true)),
            _ => Ok((self.corners.get(code - 1), false)),
        }
    }

    fn with_edge(&mut self, edge: u8, code: u8) -> Result<[u32; 3], String> {
        let [a, b] = self.edges.get(edge);
        let (c, is_new) = match code {
            13 => (self.written.wrapping_sub(1), true),
            14 => (self.written.wrapping_add(1), true),
            15 => (self.next_written()?, true),
            0 => (self.next_new(), true),
            _ => (self.corners.get(code), false),
        };
        if code == 13 || code == 14 {
            self.written = c;
        }
        if is_new {
            self.corners.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }

    fn without_edge(&mut self, code: u8, table: &[u8]) -> Result<[u32; 3], String> {
        let in_table = code < 14;
        let pair = if in_table {
            table[usize::from(code)]
        } else {
            self.numbers.byte()?
        };
        if !in_table && pair == 0 {
            self.new = 0;
        }
        let a = if code == 15 {
            self.next_written()?
        } else {
            self.next_new()
        };
        let (b, b_is_new) = self.by_code(pair >> 4, !in_table)?;
        let (c, c_is_new) = self.by_code(pair & 15, !in_table)?;
        self.corners.push(a);
        if b_is_new {
            self.corners.push(b);
        }
        if c_is_new {
            self.corners.push(c);
        }
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }
}

/// The corners of triangles.
pub(super) fn triangles(stream: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let body = body(stream, 0xe1, "triangles")?;
    let (codes, rest) = body.split_at_checked(count / 3).ok_or("it is cut")?;
    let numbers = rest.len().checked_sub(TABLE).ok_or("it is cut")?;
    let (numbers, table) = rest.split_at(numbers);
    let mut state = Corners {
        numbers: Stream { left: numbers },
        new: 0,
        written: 0,
        corners: Last::new(),
        edges: Last::new(),
    };
    let mut indices = Vec::with_capacity(count);
    for code in codes {
        let (edge, corner) = (code >> 4, code & 15);
        indices.extend(match edge {
            15 => state.without_edge(corner, table)?,
            _ => state.with_edge(edge, corner)?,
        });
    }
    state.numbers.check_end()?;
    Ok(indices)
}

/// Indices, each a difference from the last of one of two.
pub(super) fn sequence(stream: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let body = body(stream, 0xd1, "indices")?;
    // Each takes a byte at least, and four bytes of padding follow.
    if body.len() < count {
        return Err("it is cut".into());
    }
    let mut numbers = Stream { left: body };
    let mut last = [0u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let code = numbers.number()?;
        let last = &mut last[code as usize & 1];
        *last = last.wrapping_add(signed(code >> 1));
        indices.push(*last);
    }
    match numbers.left.len() {
        4 => Ok(indices),
        left => Err(format!("{left} bytes are left at its end, expected 4")),
    }
}

/// The stream behind its mark.
fn body<'a>(stream: &'a [u8], mark: u8, what: &str) -> Result<&'a [u8], String> {
    match stream.split_first() {
        Some((&first, body)) if first == mark => Ok(body),
        Some((first, _)) => Err(format!("{what} of an unknown version, {first:#04x}")),
        None => Err("it is empty".into()),
    }
}
