use std::collections::BTreeMap;

use glam::DVec3;

use super::super as rows;
use super::*;

const NEAR: Stamp<'_> = Stamp {
    program: "swell",
    program_version: "0.1.0",
    shot: "test",
    frame: 3,
    time: 0.05,
    origin: DVec3::ZERO,
};

/// A lattice that a wave has moved, each particle up to a tenth of the spacing off its site.
fn water(n: u32) -> Particles {
    let at = |i: u32| [i % 64, i / 64 % 16, i / 1024].map(|k| 0.05 + 0.1 * k as f32);
    let own =
        |i: u32, k: u32| (i ^ k << 20).wrapping_mul(2_654_435_761) as f32 / u32::MAX as f32 - 0.5;
    let swing = |i: u32, k: u32| (3.0 * at(i)[0] + k as f32).sin() + 0.02 * own(i, k);
    let place = |i: u32| [0, 1, 2].map(|k| at(i)[k as usize] + 0.02 * own(i, k));
    Particles {
        position: (0..n).map(place).collect(),
        velocity: (0..n).map(|i| [3, 4, 5].map(|k| swing(i, k))).collect(),
        id: (0..n).map(|i| 2 * i + 1).collect(),
        attributes: BTreeMap::from([("age".to_owned(), (0..n).map(|i| swing(i, 6)).collect())]),
        ..Particles::default()
    }
}

fn packed(stamp: &Stamp<'_>, particles: &Particles) -> Vec<u8> {
    let mut bytes = Vec::new();
    let written = encode(&mut bytes, stamp, particles).unwrap();
    assert_eq!(written.bytes, bytes.len() as u64);
    assert_eq!(written.hash, blake3::hash(&bytes));
    bytes
}

/// Encodes as older versions of swell did.
fn packed_before(stamp: &Stamp<'_>, particles: &Particles) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_as(Content::Values, &mut bytes, stamp, particles).unwrap();
    bytes
}

fn plain(stamp: &Stamp<'_>, particles: &Particles) -> Vec<u8> {
    let mut bytes = Vec::new();
    rows::encode(&mut bytes, stamp, particles).unwrap();
    bytes
}

/// Compresses other content as our streams are compressed.
fn stream_of(content: &[u8]) -> Vec<u8> {
    zstd::encode_all(content, LEVEL).unwrap()
}

fn refused(bytes: &[u8]) -> String {
    match decode(bytes, Path::new("f.ply.zst")) {
        Err(CacheError::Damaged { what, .. }) => what,
        other => panic!("not refused: {other:?}"),
    }
}

/// No particle, one, a whole block, and a block plus one row; near the world's origin and far from
/// it.
#[test]
fn particles_come_back_bit_for_bit() {
    let far = Stamp {
        origin: DVec3::new(8192.0, 0.0, -64.0),
        ..NEAR
    };
    for n in [0, 1, ROWS as u32, ROWS as u32 + 1] {
        for stamp in [NEAR, far] {
            let mut particles = water(n);
            if let Some(first) = particles.velocity.first_mut() {
                *first = [f32::NAN, -0.0, f32::MIN_POSITIVE / 2.0];
            }
            let back = decode(&packed(&stamp, &particles), Path::new("f")).unwrap();
            // Compared as the plain file's bytes, in which NaN equals itself and 0 is not -0.
            let expected = plain(&stamp, &particles);
            assert!(plain(&stamp, &back) == expected, "{n} at {}", stamp.origin);
            let before = decode(&packed_before(&stamp, &particles), Path::new("f")).unwrap();
            assert!(plain(&stamp, &before) == expected, "{n} of before");
            if let Some(last) = particles.id.last_mut() {
                *last += 1;
                assert!(plain(&stamp, &particles) != expected, "control");
            }
        }
    }
}

/// For water that waves have moved; compressing plain rows does not reach this ratio.
#[test]
fn it_takes_at_most_six_tenths_of_the_bytes() {
    let particles = water(40_000);
    let whole = plain(&NEAR, &particles);
    let share = |bytes: &[u8]| bytes.len() as f64 / whole.len() as f64;
    let (planes, rows) = (share(&packed(&NEAR, &particles)), share(&stream_of(&whole)));
    assert!(planes <= 0.6, "{planes}");
    assert!(rows > planes + 0.1, "control: {rows} to {planes}");
    let before = share(&packed_before(&NEAR, &particles));
    assert!(before > planes + 0.01, "{before} to {planes}");
}

#[test]
fn other_content_is_refused() {
    let particles = water(3);
    let sound = packed(&NEAR, &particles);
    let content = zstd::decode_all(&*sound).unwrap();
    for length in 0..sound.len() {
        refused(&sound[..length]);
    }
    assert!(refused(&[&*sound, b"x"].concat()).contains("1 bytes follow"));
    for (content, words) in [
        (&content[..content.len() - 1], "and 95 bytes follow"),
        (&[&*content, b"x"].concat(), "more data"),
        (&plain(&NEAR, &particles), "not that of a compressed frame"),
    ] {
        let what = refused(&stream_of(content));
        assert!(what.contains(words), "{what}");
    }
    assert!(refused(&plain(&NEAR, &particles)).starts_with("Zstandard"));
    let error = rows::decode(&content, Path::new("f")).unwrap_err();
    assert!(error.to_string().contains("compressed frame"), "{error}");
    assert!(
        decode(&stream_of(&content), Path::new("f")).is_ok(),
        "control"
    );
}

/// A header of a few hundred bytes may promise 2^40 particles.
#[test]
fn a_huge_promise_is_refused_for_what_is_there() {
    let content = zstd::decode_all(&*packed(&NEAR, &water(3))).unwrap();
    let at = content.windows(8).position(|w| w == b"vertex 3").unwrap();
    let more = [&content[..at], b"vertex 1099511627776", &content[at + 8..]].concat();
    assert!(refused(&stream_of(&more)).contains("and 96 bytes follow"));
}
