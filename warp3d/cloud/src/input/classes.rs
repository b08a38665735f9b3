//! Classes of points as the ASPRS numbers them in LAS: their names, and a colour for each number.

/// Name and sRGB colour of the classes of LAS 1.4, from 0 on.
const CLASSES: [(&str, [u8; 3]); 19] = [
    ("never classified", [170, 170, 170]),
    ("unclassified", [205, 205, 205]),
    ("ground", [166, 124, 82]),
    ("low vegetation", [184, 214, 122]),
    ("medium vegetation", [112, 180, 80]),
    ("high vegetation", [44, 122, 54]),
    ("building", [214, 96, 77]),
    ("low noise", [255, 0, 255]),
    ("model key point", [255, 220, 0]),
    ("water", [67, 147, 211]),
    ("rail", [110, 90, 160]),
    ("road surface", [120, 120, 130]),
    ("overlap", [240, 200, 160]),
    ("wire guard", [255, 170, 0]),
    ("wire conductor", [255, 120, 0]),
    ("transmission tower", [140, 40, 140]),
    ("wire connector", [200, 100, 0]),
    ("bridge deck", [90, 60, 50]),
    ("high noise", [255, 0, 140]),
];

/// The name of a class; numbers beyond the standard's have none.
pub fn class_name(class: u8) -> Option<&'static str> {
    CLASSES.get(usize::from(class)).map(|(name, _)| *name)
}

/// The sRGB colour of a class; numbers beyond the standard's have none.
pub fn class_colour(class: u8) -> Option<[u8; 3]> {
    CLASSES.get(usize::from(class)).map(|(_, colour)| *colour)
}
