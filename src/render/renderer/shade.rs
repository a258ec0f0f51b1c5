//! Plans the shading of the picture and of the additional channels.

use crate::{
    RenderScene,
    buffers::{BANDS, CARRIED, OWNER, THICKNESS, TRIANGLES, aovs, objects, picture},
    moving::carried,
    plan::Plan,
    tiles::{TILE, Tiles},
    uniform::{Band, TileGrid},
};
use swell_gpu::{
    buffer::Buf,
    recording::{Bind, Command, Groups},
};
use swell_scene::look::{AovSpec, LightSpec, Look, MethodSpec, SolidsOutput};

/// Pass over tiles with solids but no water.
const DRY: &str = "ssfr/shade_dry";
/// Pass over tiles with neither.
const BARE: &str = "ssfr/shade_bare";
/// Pass that adds the light of spray.
const WITH_SPRAY: &str = "ssfr/shade_spray";

/// Shading commands, band by band.
pub(super) struct Shade {
    pub(super) picture: Vec<Command>,
    /// Empty where the look requests no additional channels.
    pub(super) aovs: Vec<Command>,
}

/// Plans the shading of all bands: the first pass, with the first bindings, shades the picture, the
/// second one the additional channels.
fn plan_bands(
    plan: &mut Plan,
    look: &Look,
    passes: [&'static str; 2],
    binds: [&dyn Fn() -> Vec<Bind>; 2],
) -> Shade {
    let has_aovs = !look.spec().output.aovs.is_empty();
    let bands: Vec<Band> = plan
        .bands
        .iter()
        .scan(0, |next, &rows| {
            let row = *next;
            *next += rows;
            Some(Band {
                row,
                rows,
                ..Band::default()
            })
        })
        .collect();
    plan.windows(&BANDS, &bands);
    let width = plan.extent.picture[0];
    let mut shade = Shade {
        picture: Vec::new(),
        aovs: Vec::new(),
    };
    for (index, band) in bands.iter().enumerate() {
        let pixels = width as usize * band.rows as usize;
        let groups = Groups::Pixels([width, band.rows]);
        let into = |output, binds: &dyn Fn() -> Vec<Bind>| {
            [binds(), vec![BANDS.bind(index), output]].concat()
        };
        plan.buffer(&picture(index), plan.stride * pixels);
        let output = Bind::whole("output", &picture(index));
        let command = Command::in_groups(passes[0], groups.clone(), into(output, binds[0]));
        shade.picture.push(command);
        if has_aovs {
            plan.buffer(&aovs(index), pixels);
            let output = Bind::whole("output", &aovs(index));
            let command = Command::in_groups(passes[1], groups, into(output, binds[1]));
            shade.aovs.push(command);
        }
    }
    shade
}

/// Configures a pass that shades the picture for the look's treatment of opaque geometry and the
/// requested light components; with spray also defines `condition`.
fn plan_output(plan: &mut Plan, look: &Look, pass: &'static str, condition: &'static str) {
    if draws_spray(look) {
        plan.define(pass, condition);
    }
    if look.spec().output.solids == SolidsOutput::Holdout {
        plan.define(pass, "HOLDOUT");
    }
    plan_lights(plan, look, pass);
}

/// Configures a pass for the light components that the look requests.
fn plan_lights(plan: &mut Plan, look: &Look, pass: &'static str) {
    let lights = look.lights();
    if lights.is_empty() {
        return;
    }
    plan.define(pass, "LIGHTS");
    if tells_foam(look) {
        plan.define(pass, "FOAM");
    }
    let parts = LightSpec::NAMED.iter().enumerate();
    let written: u32 = parts
        .filter(|(_, (_, light))| lights.contains(light))
        .map(|(part, _)| 1 << part)
        .sum();
    let constants = vec![
        ("WRITTEN_LIGHTS", f64::from(written)),
        ("STRIDE", plan.stride as f64),
    ];
    plan.constants.insert(pass, constants);
}

/// Plans the pass that identifies the objects of a sample; nothing where the look requests no
/// Cryptomatte. Must follow the shading, whose bands it uses.
pub(super) fn plan_objects(
    plan: &mut Plan,
    look: &Look,
    pass: &'static str,
    binds: &dyn Fn() -> Vec<Bind>,
) -> Vec<Command> {
    if !look.spec().output.cryptomatte {
        return Vec::new();
    }
    plan.define(pass, "OBJECTS");
    if draws_spray(look) {
        plan.define(pass, "SPRAY");
    }
    let width = plan.extent.picture[0];
    let mut commands = Vec::new();
    for (index, rows) in plan.bands.clone().into_iter().enumerate() {
        let into = objects(index);
        plan.buffer(&into, width as usize * rows as usize);
        let own = vec![BANDS.bind(index), Bind::whole("output", &into)];
        let binds = [binds(), own].concat();
        commands.push(Command::in_groups(
            pass,
            Groups::Pixels([width, rows]),
            binds,
        ));
    }
    commands
}

/// Whether foam is separated from spray: where a light component asks for either and there is a
/// whitewater stream with both.
pub(super) fn tells_foam(look: &Look) -> bool {
    let mut lights = look.lights().into_iter();
    let is_layer = lights.any(|light| matches!(light, LightSpec::Spray | LightSpec::Foam));
    is_layer && look.spec().whitewater.is_some()
}

pub(super) fn draws_spray(look: &Look) -> bool {
    look.spec().water.spray.is_some() || look.spec().whitewater.is_some()
}

/// Whether an additional channel shows spray where it hides what is behind.
pub(super) fn wants_spray_aovs(look: &Look) -> bool {
    let mut shown = [AovSpec::Z, AovSpec::P, AovSpec::Forward].into_iter();
    draws_spray(look) && shown.any(|aov| look.wants(aov))
}

/// Configures a pass that shades water for the foam on it.
fn plan_foam(plan: &mut Plan, look: &Look, pass: &'static str) {
    if look.spec().whitewater.is_some() {
        plan.define(pass, "FOAM_LAYER");
    }
}

/// Plans the shading of splats; `surface` holds the smoothed depth.
pub(super) fn plan_shade(plan: &mut Plan, look: &Look, surface: &Buf<f32>) -> Shade {
    plan_output(plan, look, "ssfr/shade", "SPRAY");
    plan_foam(plan, look, "ssfr/shade");
    plan_output(plan, look, DRY, "SPRAY");
    plan_output(plan, look, BARE, "SPRAY");
    plan.define("ssfr/shade_aovs", "AOVS");
    if wants_spray_aovs(look) {
        plan.define("ssfr/shade_aovs", "SPRAY");
    }
    // Without `forward` the owner is not read, and any buffer of words satisfies the binding.
    let owner = match look.wants(AovSpec::Forward) {
        true => OWNER,
        false => THICKNESS,
    };
    let binds = || {
        let surface = Bind::whole("surface", surface);
        let triangles = Bind::whole("set_triangles", &TRIANGLES);
        vec![surface, Bind::whole("owner", &owner), triangles]
    };
    let passes = ["ssfr/shade", "ssfr/shade_aovs"];
    let mut shade = plan_bands(plan, look, passes, [&binds, &binds]);
    let bands: Vec<Command> = std::mem::take(&mut shade.picture);
    for (index, band) in bands.into_iter().enumerate() {
        let grid = tile_grid(plan, index);
        let spray = match draws_spray(look) {
            true => plan_spray_light(plan, look, index, grid),
            false => Vec::new(),
        };
        match look.spec().sea {
            None => (shade.picture).extend(by_tiles(plan, surface, (index, grid), band)),
            // The sea may be visible anywhere.
            Some(_) => shade.picture.push(band),
        }
        shade.picture.extend(spray);
    }
    let seen = || {
        let triangles = Bind::whole("set_triangles", &TRIANGLES);
        vec![Bind::whole("surface", surface), triangles]
    };
    let objects = plan_objects(plan, look, "ssfr/shade_objects", &seen);
    shade.picture.extend(objects);
    shade
}

/// Grid of the tiles that cover a band of the picture. Tiles begin at multiples of their size in
/// the frame, regardless of the part that is drawn.
fn tile_grid(plan: &Plan, band: usize) -> TileGrid {
    let [left, top] = plan.extent.margin;
    let row: u32 = plan.bands[..band].iter().sum();
    let first = [left, top + row];
    let size = [plan.extent.picture[0], plan.bands[band]];
    let corner = [0, 1].map(|axis| first[axis] - first[axis] % TILE[axis]);
    TileGrid {
        corner,
        size: [0, 1]
            .map(|axis| (first[axis] + size[axis]).next_multiple_of(TILE[axis]) - corner[axis]),
        tile: TILE,
        frame: plan.extent.size,
    }
}

/// Shades a band by three passes: over tiles with water, over others with solids, and over those
/// with neither.
fn by_tiles(
    plan: &mut Plan,
    surface: &Buf<f32>,
    (index, grid): (usize, TileGrid),
    shade: Command,
) -> Vec<Command> {
    let Command::Dispatch { pass, binds, .. } = shade else {
        return vec![shade];
    };
    for pass in [pass, DRY, BARE] {
        plan.define(pass, "LISTED");
    }
    for pass in [DRY, BARE] {
        plan.define(pass, "DRY");
    }
    plan.define(BARE, "BARE");
    let (tiles, mut commands) = Tiles::of_picture(plan, &format!("shade.{index}"), grid, surface);
    let binds = [binds, vec![tiles.bind()]].concat();
    commands.push(Command::in_groups(pass, tiles.wet(), binds.clone()));
    commands.push(Command::in_groups(DRY, tiles.dry(), binds.clone()));
    commands.push(Command::in_groups(BARE, tiles.bare(), binds));
    commands
}

/// Adds the light of spray to a band, in tiles with spray.
fn plan_spray_light(plan: &mut Plan, look: &Look, index: usize, grid: TileGrid) -> Vec<Command> {
    plan_lights(plan, look, WITH_SPRAY);
    let (tiles, mut commands) = Tiles::of_spray(plan, &format!("spray.{index}"), grid);
    let output = Bind::whole("output", &picture(index));
    let binds = vec![BANDS.bind(index), output, tiles.bind()];
    commands.push(Command::in_groups(WITH_SPRAY, tiles.wet(), binds));
    commands
}

/// Plans how moving solids and wave makers, of these material codes, move to the next frame.
pub(super) fn plan_carried(plan: &mut Plan, look: &Look, scene: &RenderScene, codes: &[u32]) {
    if let Some(all) = carried(look, scene, codes) {
        plan.values(&CARRIED, &all);
        let pass = match look.spec().renderer.method {
            MethodSpec::Ssfr => "ssfr/shade_aovs",
            MethodSpec::Ray => "rays/aovs",
        };
        plan.define(pass, "CARRIED");
    }
}

/// Plans the casting of rays.
pub(super) fn plan_cast(plan: &mut Plan, look: &Look) -> Shade {
    plan_output(plan, look, "rays/cast", "VOLUME");
    plan_foam(plan, look, "rays/cast");
    if look.wants(AovSpec::Forward) {
        plan.define("rays/aovs", "FORWARD");
    }
    if wants_spray_aovs(look) {
        plan.define("rays/aovs", "SPRAY");
    }
    let passes = ["rays/cast", "rays/aovs"];
    let mut shade = plan_bands(plan, look, passes, [&Vec::new, &Vec::new]);
    let objects = plan_objects(plan, look, "rays/objects", &Vec::new);
    shade.picture.extend(objects);
    shade
}
