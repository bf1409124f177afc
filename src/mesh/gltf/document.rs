//! The JSON of a glTF file: what of it is read, and where its mesh stands in the scene.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3};
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::text::quoted;

/// Extensions that change looks alone, by the start of their names.
const LOOKS: [&str; 3] = ["KHR_materials_", "KHR_texture_", "KHR_lights_"];

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Document {
    pub extensions_required: Vec<String>,
    pub scene: Option<usize>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<View>,
    pub buffers: Vec<Buffer>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub nodes: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub children: Vec<usize>,
    /// By columns.
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    /// x, y, z, w of a unit quaternion.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    #[serde(default)]
    pub name: String,
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    /// The accessor of each.
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<IgnoredAny>,
    pub mode: Option<u64>,
    #[serde(default)]
    pub targets: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u64,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

impl Primitive {
    /// What of it the mesh has no place for.
    pub fn not_kept(&self) -> impl Iterator<Item = String> {
        let attributes = self.attributes.keys().filter(|name| *name != "POSITION");
        let attributes = attributes.map(|name| name.escape_debug().to_string());
        let material = self.material.as_ref().map(|_| "materials".to_owned());
        let targets = (!self.targets.is_empty()).then(|| "morph targets".to_owned());
        attributes.chain(material).chain(targets)
    }
}

impl Node {
    fn transform(&self) -> DMat4 {
        if let Some(columns) = &self.matrix {
            return DMat4::from_cols_array(columns);
        }
        DMat4::from_scale_rotation_translation(
            self.scale.map_or(DVec3::ONE, DVec3::from),
            self.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q).normalize()),
            self.translation.map_or(DVec3::ZERO, DVec3::from),
        )
    }
}

impl Document {
    /// The one mesh, the transform of the node that places it, and what is to be remarked of that.
    pub fn placed_mesh(&self) -> Result<(&Mesh, DMat4, Vec<String>), String> {
        if let Some(name) =
            self.extensions_required.iter().find(|name| !LOOKS.iter().any(|start| name.starts_with(start)))
        {
            return Err(format!(
                "the file requires the extension {}, which is not read: export without it",
                quoted(name.as_bytes())
            ));
        }
        let mesh = match &self.meshes[..] {
            [] => return Err("the file holds no mesh".into()),
            [mesh] => mesh,
            several => {
                const SHOWN: usize = 10;
                let names: Vec<String> = several.iter().take(SHOWN).map(|m| quoted(m.name.as_bytes())).collect();
                let more = if several.len() > SHOWN { ", …" } else { "" };
                let what = format!("{} meshes, {}{more}: save them in a file each", several.len(), names.join(", "));
                return Err(what);
            }
        };
        let placements = self.placements()?;
        let (transform, remark) = match placements[..] {
            [] if self.nodes.is_empty() => (DMat4::IDENTITY, None),
            [] => (DMat4::IDENTITY, Some("no node of the scene shows the mesh: it stands in its own coordinates")),
            // The joints alone place it.
            [node] if self.nodes[node.0].skin.is_some() => {
                (DMat4::IDENTITY, Some("its skin is not applied: it stands in its own coordinates"))
            }
            [(_, transform)] => (transform, None),
            [(a, _), (b, _), ..] => {
                return Err(format!(
                    "{} nodes show the mesh, nodes[{a}] and nodes[{b}] among them: join what they show, and save that as \
                     one mesh",
                    placements.len()
                ));
            }
        };
        Ok((mesh, transform, remark.map(str::to_owned).into_iter().collect()))
    }

    /// The nodes of the scene that show a mesh, and their transforms.
    fn placements(&self) -> Result<Vec<(usize, DMat4)>, String> {
        let roots = match (self.scene, self.scenes.first()) {
            (Some(scene), _) => {
                self.scenes.get(scene).ok_or_else(|| format!("scenes[{scene}] is not there"))?.nodes.clone()
            }
            (None, Some(first)) => first.nodes.clone(),
            (None, None) => {
                let children: Vec<usize> = self.nodes.iter().flat_map(|node| node.children.iter().copied()).collect();
                (0..self.nodes.len()).filter(|node| !children.contains(node)).collect()
            }
        };
        let mut waiting: Vec<(usize, DMat4)> = roots.into_iter().rev().map(|root| (root, DMat4::IDENTITY)).collect();
        let mut seen = vec![false; self.nodes.len()];
        let mut placements = Vec::new();
        while let Some((at, above)) = waiting.pop() {
            let node = self.nodes.get(at).ok_or_else(|| format!("nodes[{at}] is not there"))?;
            if std::mem::replace(&mut seen[at], true) {
                return Err(format!("nodes[{at}] hangs on two nodes, or on itself"));
            }
            let transform = above * node.transform();
            placements.extend(node.mesh.map(|_| (at, transform)));
            waiting.extend(node.children.iter().rev().map(|&child| (child, transform)));
        }
        Ok(placements)
    }
}
