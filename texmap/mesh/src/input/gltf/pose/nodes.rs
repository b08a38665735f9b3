//! The node hierarchy: where every node stands in the world, and which nodes a scene shows.
//!
//! Takes the document, gives one transform per node and the nodes of the chosen scene. Transforms are composed in f64,
//! from parents to children; a node with two parents and a cycle are errors, so no walk can go on for ever.
//! Source: glTF 2.0, 3.5.

use glam::DMat4;
use gltf::json::Root;
use gltf::json::scene::Node;

use crate::input::choice::SceneChoice;
use crate::input::files::excerpt;

/// From the space of each node to the world, by those to their parents.
pub(crate) fn world_from_nodes(
    root: &Root,
    parent_from_nodes: &[DMat4],
) -> Result<Vec<DMat4>, String> {
    let parents = parents(root)?;
    let mut world: Vec<Option<DMat4>> = vec![None; root.nodes.len()];
    for start in 0..root.nodes.len() {
        // Up to the first node whose place is known, then down again.
        let mut chain = Vec::new();
        let mut next = Some(start);
        while let Some(node) = next.filter(|&node| world[node].is_none()) {
            if chain.len() > root.nodes.len() {
                return Err(format!(
                    "node {start} is below itself: the nodes form a cycle"
                ));
            }
            chain.push(node);
            next = parents[node];
        }
        let mut above = next.and_then(|node| world[node]).unwrap_or(DMat4::IDENTITY);
        for &node in chain.iter().rev() {
            above *= parent_from_nodes[node];
            world[node] = Some(above);
        }
    }
    Ok(world
        .into_iter()
        .map(|transform| transform.unwrap_or(DMat4::IDENTITY))
        .collect())
}

/// The nodes that a scene shows, in the order of the file: its own and all below them.
pub(crate) fn shown(root: &Root, choice: Option<&SceneChoice>) -> Result<Vec<usize>, String> {
    let mut todo: Vec<usize> = match chosen(root, choice)? {
        Some(scene) => root.scenes[scene]
            .nodes
            .iter()
            .rev()
            .map(gltf::json::Index::value)
            .collect(),
        // A file without scenes is a library of parts; all of them are shown.
        None => roots(root).into_iter().rev().collect(),
    };
    let mut seen = vec![false; root.nodes.len()];
    let mut shown = Vec::new();
    while let Some(node) = todo.pop() {
        let seen = seen
            .get_mut(node)
            .ok_or_else(|| format!("node {node} does not exist"))?;
        if !std::mem::replace(seen, true) {
            shown.push(node);
            todo.extend(children(&root.nodes[node]).rev());
        }
    }
    Ok(shown)
}

fn chosen(root: &Root, choice: Option<&SceneChoice>) -> Result<Option<usize>, String> {
    let count = root.scenes.len();
    let (index, asked) = match choice {
        None => match (root.scene, count) {
            (Some(scene), _) => (Some(scene.value()), "the default scene".to_owned()),
            (None, 0) => return Ok(None),
            (None, _) => (Some(0), "the first scene".to_owned()),
        },
        Some(SceneChoice(word)) => {
            let by_name = root
                .scenes
                .iter()
                .position(|scene| scene.name.as_deref() == Some(word));
            (
                by_name.or_else(|| word.parse().ok()),
                format!("scene '{}'", excerpt(word)),
            )
        }
    };
    match index.filter(|&index| index < count) {
        Some(index) => Ok(Some(index)),
        None => Err(format!("{asked} does not exist: {}", list_of_scenes(root))),
    }
}

fn list_of_scenes(root: &Root) -> String {
    // More would not be read.
    const LISTED: usize = 10;
    let named = |(index, scene): (usize, &gltf::json::Scene)| match &scene.name {
        Some(name) => format!("{index} ({})", excerpt(name)),
        None => index.to_string(),
    };
    match root.scenes.len() {
        0 => "the file has no scenes".to_owned(),
        _ => {
            let names: Vec<_> = root
                .scenes
                .iter()
                .enumerate()
                .take(LISTED)
                .map(named)
                .collect();
            format!("the file has {}", names.join(", "))
        }
    }
}

fn roots(root: &Root) -> Vec<usize> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(children) {
        if let Some(flag) = is_child.get_mut(child) {
            *flag = true;
        }
    }
    (0..root.nodes.len())
        .filter(|&node| !is_child[node])
        .collect()
}

fn parents(root: &Root) -> Result<Vec<Option<usize>>, String> {
    let mut parents = vec![None; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for child in children(node) {
            let slot = parents
                .get_mut(child)
                .ok_or_else(|| format!("node {parent}: child {child} does not exist"))?;
            if let Some(other) = slot.replace(parent) {
                return Err(format!(
                    "node {child} is a child of both node {other} and node {parent}"
                ));
            }
        }
    }
    Ok(parents)
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(gltf::json::Index::value)
}
