//! The arrays of a file, by their places in its groups, and the values of their attributes.

use netcdf_reader::{NcAttrValue, NcAttribute, NcGroup, NcType, NcVariable};

/// An array, and the groups that it lies in.
#[derive(Clone)]
pub(crate) struct Found<'a> {
    /// Names of the groups and of the array, joined by `/`.
    pub(crate) path: String,
    pub(crate) variable: &'a NcVariable,
    /// From the root to the array's own.
    groups: Vec<(String, &'a NcGroup)>,
}

/// All arrays, group by group.
pub(crate) fn arrays(root: &NcGroup) -> Vec<Found<'_>> {
    let mut all = Vec::new();
    let mut open = vec![vec![(String::new(), root)]];
    while let Some(groups) = open.pop() {
        let Some((place, group)) = groups.last() else {
            continue;
        };
        all.extend(group.variables.iter().map(|variable| Found {
            path: format!("{place}{}", variable.name),
            variable,
            groups: groups.clone(),
        }));
        open.extend(group.groups.iter().rev().map(|inner| {
            let mut inside = groups.clone();
            inside.push((format!("{place}{}/", inner.name), inner));
            inside
        }));
    }
    all
}

impl<'a> Found<'a> {
    /// Elements along each axis.
    pub(crate) fn shape(&self) -> Vec<usize> {
        let sizes = self.variable.dimensions.iter();
        sizes
            .map(|axis| usize::try_from(axis.size).unwrap_or(usize::MAX))
            .collect()
    }

    /// The coordinates along an axis: the array of one axis that has its name, in the group or the nearest one around it.
    pub(crate) fn coordinates(&self, axis: &str) -> Option<(String, &'a NcVariable)> {
        self.groups.iter().rev().find_map(|(place, group)| {
            let found = group.coordinate_variable(axis)?;
            Some((format!("{place}{axis}"), found))
        })
    }

    /// The group of a name that the array lies in.
    pub(crate) fn group(&self, name: &str) -> Option<&'a NcGroup> {
        let groups = self.groups.iter().map(|(_, group)| *group);
        { groups }.find(|group| group.name == name)
    }

    pub(crate) fn text(&self, name: &str) -> Option<String> {
        text(&self.variable.attributes, name)
    }

    pub(crate) fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        numbers(&self.variable.attributes, name)
    }

    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.numbers(name)?.first().copied()
    }
}

/// The text of an attribute. Some programs store an array of letters.
pub(crate) fn text(attributes: &[NcAttribute], name: &str) -> Option<String> {
    let found = attributes.iter().find(|attribute| attribute.name == name)?;
    match &found.value {
        NcAttrValue::Chars(text) => Some(text.trim_end_matches('\0').to_owned()),
        NcAttrValue::Strings(parts) => Some(parts.concat()),
        _ => None,
    }
}

/// The numbers of an attribute, written as such or as a text.
pub(crate) fn numbers(attributes: &[NcAttribute], name: &str) -> Option<Vec<f64>> {
    let found = attributes.iter().find(|attribute| attribute.name == name)?;
    if let Some(numbers) = found.value.as_f64_vec() {
        return Some(numbers);
    }
    let text = text(attributes, name)?;
    text.split_whitespace()
        .map(|word| word.parse().ok())
        .collect()
}

/// The group below another, by the names on the way.
pub(crate) fn group<'a>(root: &'a NcGroup, names: &[&str]) -> Option<&'a NcGroup> {
    names.iter().try_fold(root, |group, name| {
        group.groups.iter().find(|inner| inner.name == *name)
    })
}

/// True for integers, real numbers and booleans.
pub(crate) fn is_number(of: &NcType) -> bool {
    match of {
        NcType::Byte
        | NcType::UByte
        | NcType::Short
        | NcType::UShort
        | NcType::Int
        | NcType::UInt
        | NcType::Int64
        | NcType::UInt64
        | NcType::Float
        | NcType::Double => true,
        NcType::Enum { base, .. } => is_number(base),
        _ => false,
    }
}
