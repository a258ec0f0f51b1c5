use super::*;

/// Cells of 1 m, eight particles in each.
fn band(cells: [u32; 3], depth: u32) -> Band {
    Band {
        grid: DeepGrid {
            origin: DVec3::ZERO,
            cell_size: 1.0,
            cells,
            per_edge: 2,
            band: depth,
        },
        periodic: [false; 3],
    }
}

/// Still water on a lattice, `height` cells deep.
fn tank(cells: [u32; 3], height: u32) -> Particles {
    let mut water = Particles::default();
    let [nx, ny, nz] = [cells[0], height, cells[2]].map(|n| 2 * n);
    for k in 0..nx * ny * nz {
        let at = [k % nx, k / nx % ny, k / (nx * ny)];
        water.position.push(at.map(|k| 0.5 * k as f32 + 0.25));
        water.velocity.push([1.0, 2.0, 3.0]);
        water.id.push(k);
    }
    water
}

#[test]
fn a_tank_keeps_the_particles_of_its_band_and_its_amount() {
    let (cells, height) = ([9, 40, 10], 30);
    let mut water = tank(cells, height);
    let all = water.len();
    let relaid = band(cells, 4).enter(&mut water);
    // Depths are whole cells and a half: five layers are at most 5 deep.
    let kept = 5 * 8 * 90;
    assert_eq!((water.len(), relaid.removed), (kept, (all - kept) as u64));
    assert_eq!(water.amount(), all);
    // Cells at least 1 deep are listed, and those deeper than 4 have no particles.
    assert_eq!(water.deep.cell.len(), 29 * 90);
    assert_eq!(water.deep.count(), 26 * 90);
    assert!(water.deep.velocity.iter().all(|v| *v == [1.0, 2.0, 3.0]));
    let top = |cell: &[u32; 3]| cell[1] == 28;
    let at = water
        .deep
        .cell
        .iter()
        .position(top)
        .expect("a second layer");
    assert_eq!(water.deep.depth[at], 1.5);
}

#[test]
fn filled_water_is_what_the_band_was_laid_in() {
    let (cells, height) = ([9, 40, 10], 30);
    let mut water = tank(cells, height);
    let sorted = |water: &Particles| {
        let mut all: Vec<_> = water.position.iter().map(|x| x.map(f32::to_bits)).collect();
        all.sort_unstable();
        all
    };
    let before = sorted(&water);
    band(cells, 4).enter(&mut water);
    let filled = water.clone().filled();
    assert_eq!(sorted(&filled), before);
    assert!(filled.id.is_sorted_by(|a, b| a < b));
    assert!(filled.velocity.iter().all(|v| *v == [1.0, 2.0, 3.0]));
    // Control: a cell less deep leaves a hole.
    water.deep.depth[100] = 0.0;
    assert_ne!(sorted(&water.filled()), before);
}

/// Water whose upper layers are gone gets its band from the depth.
#[test]
fn cells_that_come_into_the_band_get_exactly_their_particles() {
    let (cells, height) = ([9, 40, 10], 30);
    let mut water = tank(cells, height);
    let band = band(cells, 4);
    band.enter(&mut water);
    let keep: Vec<bool> = water.position.iter().map(|x| x[1] < 28.0).collect();
    water.retain(&keep);
    let amount = water.amount();
    assert_eq!(amount, 28 * 90 * 8);
    let mut next_id = 1_000_000;
    let relaid = band
        .relay(&mut water, (7, amount), &mut next_id)
        .expect("thick enough");
    assert_eq!(water.amount(), amount);
    // The layer at 25 had particles; those at 24 and, in the hysteresis, at 23 had none.
    let of_layer = |water: &Particles, y: f32| {
        let is_in = |x: &&[f32; 3]| (y..y + 1.0).contains(&x[1]);
        water.position.iter().filter(is_in).count()
    };
    for layer in 23..28 {
        assert_eq!(of_layer(&water, layer as f32), 720, "{layer}");
    }
    assert_eq!(relaid.seeded, u64::from(next_id - 1_000_000));
    assert_eq!(relaid.seeded as usize, 2 * 720);
    assert!(water.id.is_sorted_by(|a, b| a < b));
    let seeds = &water.velocity[water.len() - 2 * 720..];
    let is_carried = |v: &[f32; 3]| (0..3).all(|k| (v[k] - [1.0, 2.0, 3.0][k]).abs() < 1e-5);
    assert!(seeds.iter().all(is_carried));
    // Repeatable.
    let mut again = tank(cells, height);
    band.enter(&mut again);
    again.retain(&keep);
    band.relay(&mut again, (7, amount), &mut 1_000_000)
        .expect("thick enough");
    assert_eq!(again, water);
}

#[test]
fn a_band_that_is_used_up_within_a_frame_is_an_error() {
    let (cells, height) = ([9, 40, 10], 30);
    let band = band(cells, 4);
    let mut water = tank(cells, height);
    band.enter(&mut water);
    let without = |from: f32| {
        let mut water = water.clone();
        let keep: Vec<bool> = water.position.iter().map(|x| x[1] < from).collect();
        water.retain(&keep);
        let amount = water.amount();
        band.relay(&mut water, (1, amount), &mut 1_000_000)
            .map(|_| ())
    };
    assert_eq!(without(28.0), Ok(()));
    assert!(matches!(without(20.0), Err(BandError::TooThin { .. })));
}

/// The distance to the nearest cell of air, by trying all.
#[test]
fn depths_are_those_of_a_search() {
    let cells = [17, 11, 9];
    let mut water = Particles::default();
    let mut is_full = Vec::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let full = y < 8 && !(6..9).contains(&x);
                is_full.push(full);
                for k in 0..if full { 8 } else { 0u32 } {
                    let at = [x, y, z].map(|k| k as f32);
                    let part = [k & 1, k >> 1 & 1, k >> 2].map(|k| 0.5 * k as f32 + 0.25);
                    water.position.push([0, 1, 2].map(|k| at[k] + part[k]));
                    water.velocity.push([0.0; 3]);
                    water.id.push(water.id.len() as u32);
                }
            }
        }
    }
    let band = band(cells, 3);
    let bricks = band.bricks(&water);
    let counts = band.counts(&water, &bricks);
    let none = vec![0.0; counts.len()];
    let found = band.depth(&bricks, &counts, &none);
    let cell_of = |k: usize| {
        let [nx, ny] = [cells[0] as usize, cells[1] as usize];
        [k % nx, k / nx % ny, k / (nx * ny)].map(|k| k as i64)
    };
    // Where fewer than half of the cells around are full, as at an edge, is air.
    let is_beside = |k: usize, l: usize| {
        let (own, other) = (cell_of(k), cell_of(l));
        (0..3).all(|axis| (own[axis] - other[axis]).abs() <= 1)
    };
    let is_water = |k: usize| {
        let about: Vec<usize> = (0..is_full.len()).filter(|l| is_beside(k, *l)).collect();
        2 * about.iter().filter(|l| is_full[**l]).count() >= about.len()
    };
    let is_full: Vec<bool> = (0..is_full.len()).map(is_water).collect();
    let mut deepest = 0.0f32;
    for (k, full) in is_full.iter().enumerate() {
        let own = cell_of(k);
        let square = |l: usize| -> i64 {
            let other = cell_of(l);
            (0..3).map(|axis| (own[axis] - other[axis]).pow(2)).sum()
        };
        let air = (0..is_full.len())
            .filter(|l| !is_full[*l])
            .map(square)
            .min();
        let expected = match full {
            true => ((air.unwrap_or(25).min(25) as f64).sqrt() - 0.5) as f32,
            false => 0.0,
        };
        let depth = found[bricks.element(own) as usize];
        assert_eq!(depth, expected, "{own:?}");
        deepest = deepest.max(depth);
    }
    assert_eq!(deepest, 4.5);
}

/// Water that lacks particles, or has too many, gets its amount back at the band's end, one in each
/// of the cells there.
#[test]
fn the_amount_is_kept_one_particle_in_a_cell() {
    let (cells, height) = ([9, 40, 10], 30);
    let band = band(cells, 4);
    let mut water = tank(cells, height);
    band.enter(&mut water);
    let amount = water.amount();
    for (off, left) in [(7i32, 0i32), (-11, 0), (100, 10), (-100, -10)] {
        let mut water = water.clone();
        let asked = amount.checked_add_signed(off as isize).unwrap();
        let mut next_id = 1_000_000;
        let relaid = band
            .relay(&mut water, (3, asked), &mut next_id)
            .expect("thick enough");
        let found = water.amount() as i32;
        assert_eq!(amount as i32 + off - found, left, "{off}");
        let changed = if off > 0 {
            relaid.seeded
        } else {
            relaid.removed
        };
        assert_eq!(changed as i32, (off - left).abs());
        assert!(water.id.is_sorted_by(|a, b| a < b));
    }
}

/// A particle that a cell at the band's end has lost comes back there, and one that a cell has
/// gained goes from there.
#[test]
fn lost_particles_come_back_where_they_were_lost() {
    let (cells, height) = ([9, 40, 10], 30);
    let band = band(cells, 4);
    let mut water = tank(cells, height);
    band.enter(&mut water);
    let amount = water.amount();
    let places = [[4, 26, 5], [0, 26, 9], [8, 26, 3]];
    let count = |water: &Particles, place: &[u32; 3]| {
        let is_in = |x: &&[f32; 3]| band.cell(**x) == *place;
        water.position.iter().filter(is_in).count()
    };
    let mut fewer = water.clone();
    let mut left = places.to_vec();
    let keep: Vec<bool> = (water.position.iter())
        .map(|x| {
            let found = left.iter().position(|place| band.cell(*x) == *place);
            found.map(|k| left.swap_remove(k)).is_none()
        })
        .collect();
    fewer.retain(&keep);
    let mut more = water.clone();
    for (k, place) in places.iter().enumerate() {
        more.position.push(place.map(|k| k as f32 + 0.5));
        more.velocity.push([0.0; 3]);
        more.id.push(900_000 + k as u32);
    }
    for (mut water, before) in [(fewer, 7), (more, 9)] {
        assert!(places.iter().all(|place| count(&water, place) == before));
        band.relay(&mut water, (3, amount), &mut 1_000_000)
            .expect("thick enough");
        assert_eq!(water.amount(), amount);
        assert!(places.iter().all(|place| count(&water, place) == 8));
    }
}
