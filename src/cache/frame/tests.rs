use std::collections::BTreeMap;
use std::time::Instant;

use ply_rs_bw::ply::{Ply, Property, PropertyAccess};
use proptest::prelude::*;

use super::*;

const STAMP: Stamp<'_> = Stamp {
    program: "swell",
    program_version: "0.1.0",
    shot: "test",
    frame: 3,
    time: 0.05,
    origin: DVec3::ZERO,
};

fn water(n: u32, attributes: &[&str]) -> Particles {
    let value = |i: u32, k: u32| f32::from_bits(i.wrapping_mul(2_654_435_761) ^ k) * 1e-3;
    Particles {
        position: (0..n).map(|i| [0, 1, 2].map(|k| value(i, k))).collect(),
        velocity: (0..n).map(|i| [3, 4, 5].map(|k| value(i, k))).collect(),
        id: (0..n).map(|i| 2 * i + 1).collect(),
        attributes: (6..)
            .zip(attributes)
            .map(|(k, name)| ((*name).to_owned(), (0..n).map(|i| value(i, k)).collect()))
            .collect(),
        ..Particles::default()
    }
}

fn encoded(particles: &Particles) -> Vec<u8> {
    let mut bytes = Vec::new();
    let written = encode(&mut bytes, &STAMP, particles).unwrap();
    assert_eq!(written.bytes, bytes.len() as u64);
    assert_eq!(written.hash, blake3::hash(&bytes));
    bytes
}

/// Floats as bits, so that NaN equals itself and 0 is not -0.
fn bits(particles: &Particles) -> Vec<Vec<u32>> {
    let flat = |v: &[[f32; 3]]| v.iter().flatten().map(|x| x.to_bits()).collect();
    let mut columns = vec![
        flat(&particles.position),
        flat(&particles.velocity),
        particles.id.clone(),
    ];
    for column in particles.attributes.values() {
        columns.push(column.iter().map(|x| x.to_bits()).collect());
    }
    columns
}

fn refused(bytes: &[u8]) -> String {
    match decode(bytes, Path::new("f.ply")) {
        Err(CacheError::Damaged { file, what }) => {
            assert_eq!(file, Path::new("f.ply"));
            what
        }
        other => panic!("not refused: {other:?}"),
    }
}

fn replaced(particles: &Particles, from: &str, to: &str) -> Vec<u8> {
    let bytes = encoded(particles);
    let at = bytes
        .windows(from.len())
        .position(|w| w == from.as_bytes())
        .expect("text stands in the header");
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

/// A row as ply-rs-bw itself writes it: by name, property by property.
struct Row([f32; 6], u32, BTreeMap<String, f32>);

impl PropertyAccess for Row {
    fn new() -> Self {
        Row([0.0; 6], 0, BTreeMap::new())
    }
    fn get_float(&self, name: &str) -> Option<f32> {
        match FIXED[..6].iter().position(|(fixed, _)| *fixed == name) {
            Some(k) => Some(self.0[k]),
            None => self.2.get(name).copied(),
        }
    }
    fn get_uint(&self, name: &str) -> Option<u32> {
        (name == "id").then_some(self.1)
    }
}

fn per_property(particles: &Particles) -> Ply<Row> {
    let names = particles.attributes.keys().map(String::as_str);
    let mut ply = Ply::new();
    ply.header = header(&STAMP, particles.len(), names, &particles.deep);
    let row = |i: usize| {
        let (p, v) = (particles.position[i], particles.velocity[i]);
        let extra = particles.attributes.iter();
        Row(
            [p[0], p[1], p[2], v[0], v[1], v[2]],
            particles.id[i],
            extra.map(|(name, c)| (name.clone(), c[i])).collect(),
        )
    };
    let rows = (0..particles.len()).map(row).collect();
    ply.payload.insert("vertex".to_owned(), rows);
    ply
}

#[test]
fn packed_rows_are_the_librarys_own_bytes() {
    for (n, attributes) in [(0, &[][..]), (1, &[]), (40_000, &["age", "foam"])] {
        let particles = water(n, attributes);
        let mut expected = Vec::new();
        ply_rs_bw::writer::Writer::new()
            .write_ply(&mut expected, &mut per_property(&particles))
            .unwrap();
        let bytes = encoded(&particles);
        assert!(bytes == expected, "{n} particles");
        // Negative control: flip the last bit of one particle's position.
        if n > 0 {
            let mut moved = particles.clone();
            let x = &mut moved.position[n as usize / 2][1];
            *x = f32::from_bits(x.to_bits() ^ 1);
            assert!(encoded(&moved) != expected);
        }
    }
}

#[test]
fn the_library_reads_our_file() {
    let particles = water(5, &["age"]);
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut encoded(&particles).as_slice())
        .unwrap();
    let row = &ply.payload["vertex"][4];
    assert_eq!(row["id"], Property::UInt(particles.id[4]));
    assert_eq!(row["vz"], Property::Float(particles.velocity[4][2]));
    assert_eq!(row["age"], Property::Float(particles.attributes["age"][4]));
    assert_eq!(ply.header.comments[0], "swell 0.1.0");
}

#[test]
fn the_header_is_this_one() {
    let text = "ply\nformat binary_little_endian 1.0\ncomment swell 0.1.0\ncomment shot test\n\
        comment frame 3\ncomment time 0.05\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty float vx\nproperty float vy\nproperty float vz\n\
        property uint id\nproperty float age\nend_header\n";
    let bytes = encoded(&water(1, &["age"]));
    assert_eq!(bytes.len(), text.len() + 32);
    assert_eq!(&bytes[..text.len()], text.as_bytes());
}

#[test]
fn special_floats_survive_bit_for_bit() {
    let mut particles = water(4, &["age"]);
    particles.position[0] = [f32::NAN, f32::INFINITY, -0.0];
    particles.velocity[1] = [f32::from_bits(0x7fa0_0001), f32::MIN_POSITIVE / 2.0, 0.0];
    let back = decode(&encoded(&particles), Path::new("")).unwrap();
    assert_eq!(bits(&back), bits(&particles));
}

#[test]
fn far_from_the_origin_positions_are_the_worlds_in_64_bits() {
    let far = Stamp {
        origin: DVec3::new(9_992.0, 0.0, -131_072.5),
        ..STAMP
    };
    // Like a scene's own coordinates: in [q, 4 q], here with q = 8.
    let mut particles = water(1000, &["age"]);
    for (k, p) in particles.position.iter_mut().enumerate() {
        let step = (k as u32).wrapping_mul(2_654_435_761);
        *p = [0, 7, 13].map(|turn| 8.0 + 24.0 * (step.rotate_left(turn) as f32 / 4_294_967_296.0));
    }
    let mut bytes = Vec::new();
    encode(&mut bytes, &far, &particles).unwrap();
    let back = decode(&bytes, Path::new("")).unwrap();
    assert_eq!(bits(&back), bits(&particles));
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut bytes.as_slice())
        .unwrap();
    let row = &ply.payload["vertex"][4];
    let [x, _, z] = particles.position[4].map(f64::from);
    assert_eq!(row["x"], Property::Double(9_992.0 + x));
    assert_eq!(row["z"], Property::Double(z - 131_072.5));
    assert_eq!(row["age"], Property::Float(particles.attributes["age"][4]));
    // Negative control: in 32 bits the world positions would not survive the round trip.
    let narrow = |p: &[f32; 3]| ((9_992.0 + f64::from(p[0])) as f32 - 9_992.0).to_bits();
    let lost = particles
        .position
        .iter()
        .filter(|p| narrow(p) != p[0].to_bits());
    assert!(lost.count() > 900);
    // A comment that is not ours, or that contradicts the width of the rows.
    let text = "comment origin 9992.0 0.0 -131072.5\n";
    let at = bytes
        .windows(text.len())
        .position(|w| w == text.as_bytes())
        .unwrap();
    for other in [
        "comment origin 9992 0.0 -131072.5\n",
        "comment origin 1.0 NaN 0.0\n",
        "",
    ] {
        let spoiled = [&bytes[..at], other.as_bytes(), &bytes[at + text.len()..]].concat();
        refused(&spoiled);
    }
}

#[test]
fn a_huge_promise_is_refused_at_once() {
    let particles = water(2, &[]);
    for count in [
        "1000000000000",
        "658812288346769701",
        "18446744073709551615",
    ] {
        let bytes = replaced(&particles, "vertex 2", &format!("vertex {count}"));
        let begin = Instant::now();
        assert!(refused(&bytes).contains("declares"), "{count}");
        // Allocating or looping over 10^12 rows would take minutes.
        assert!(begin.elapsed().as_millis() < 100);
    }
    refused(&replaced(
        &particles,
        "vertex 2",
        "vertex 18446744073709551616",
    ));
}

#[test]
fn headers_that_are_not_ours_are_refused() {
    let particles = water(2, &["age", "foam"]);
    assert!(decode(&encoded(&particles), Path::new("")).is_ok());
    let same = replaced(&particles, "vertex 2", "vertex 2");
    assert!(decode(&same, Path::new("")).is_ok(), "control");
    for (from, to) in [
        ("vertex 2", "vertex 1"),
        ("vertex 2", "vertex 3"),
        ("vertex 2", "vertex 02"),
        ("vertex 2", "point 2"),
        ("vertex 2", "vertex 2\nelement vertex 2"),
        ("little", "big"),
        ("1.0", "1.1"),
        ("float x\n", "float y\n"),
        ("float x\n", "int x\n"),
        ("float x\n", "float32 x\n"),
        ("float x\n", "float x\nproperty float x\n"),
        ("uint id", "int id"),
        ("float age", "uint age"),
        ("float age", "list uchar float age"),
        ("float age", "float foam"),
        ("float age", "float vx"),
        ("float age", "float zzz"),
        ("end_header", "element face 0\nend_header"),
        ("end_header\n", "end_header\r\n"),
        ("ply\n", "plx\n"),
    ] {
        refused(&replaced(&particles, from, to));
    }
}

#[test]
fn other_lengths_are_refused() {
    let bytes = encoded(&water(2, &["age"]));
    for cut in 0..bytes.len() {
        refused(&bytes[..cut]);
    }
    refused(&[&bytes[..], &[0]].concat());
    refused(&vec![b'a'; 3 * HEADER_LIMIT]);
}

#[test]
fn unfit_particles_are_refused() {
    let good = || water(3, &["age"]);
    assert!(check(&good()).is_ok());
    let refuse = |spoil: fn(&mut Particles)| {
        let mut particles = good();
        spoil(&mut particles);
        assert!(matches!(check(&particles), Err(CacheError::Unfit(_))));
    };
    refuse(|p| p.position.truncate(2));
    refuse(|p| p.velocity.truncate(2));
    refuse(|p| p.id.push(99));
    refuse(|p| p.id[2] = p.id[1]);
    refuse(|p| p.id.reverse());
    refuse(|p| p.attributes.values_mut().for_each(|c| c.truncate(1)));
    for name in ["x", "id", "", "two words", "1st", "a\nb", "é"] {
        let mut particles = good();
        particles.attributes.insert(name.to_owned(), vec![0.0; 3]);
        assert!(check(&particles).is_err(), "{name}");
    }
}

proptest! {
    #[test]
    fn any_particles_come_back(
        rows in prop::collection::vec(any::<([u32; 3], [u32; 3], u32)>(), 0..50),
        gaps in prop::collection::vec(1u32..1000, 50),
    ) {
        let float = |v: [u32; 3]| v.map(f32::from_bits);
        let mut id = 0;
        let particles = Particles {
            position: rows.iter().map(|r| float(r.0)).collect(),
            velocity: rows.iter().map(|r| float(r.1)).collect(),
            id: gaps[..rows.len()].iter().map(|gap| { id += gap; id }).collect(),
            attributes: [(
                "age".to_owned(),
                rows.iter().map(|r| f32::from_bits(r.2)).collect(),
            )].into(),
            ..Particles::default()
        };
        let back = decode(&encoded(&particles), Path::new("")).unwrap();
        prop_assert_eq!(bits(&back), bits(&particles));
    }

    #[test]
    fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(decode(&bytes, Path::new("")).is_err());
        let _ = decode(&[b"ply\n".as_slice(), &bytes].concat(), Path::new(""));
    }

    #[test]
    fn spoiled_frames_never_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = encoded(&water(3, &["age"]));
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let _ = decode(&bytes, Path::new(""));
        let _ = decode(&bytes[..cut.index(bytes.len())], Path::new(""));
    }
}

#[test]
#[ignore = "a measurement: cargo test --release --lib -- --ignored --nocapture packed_rows"]
fn packed_rows_against_per_property() {
    let particles = water(200_000, &[]);
    let best = |work: &mut dyn FnMut() -> usize| {
        let times = (0..7).map(|_| {
            let begin = Instant::now();
            let bytes = work();
            bytes as f64 / begin.elapsed().as_secs_f64() / 1e6
        });
        times.fold(0.0, f64::max)
    };
    let mut out = Vec::with_capacity(8_000_000);
    let packed = best(&mut || {
        out.clear();
        encode(&mut out, &STAMP, &particles).unwrap();
        out.len()
    });
    // The same amount of work: build rows from the state, write bytes, hash.
    let library = best(&mut || {
        out.clear();
        ply_rs_bw::writer::Writer::new()
            .write_ply_unchecked(&mut out, &per_property(&particles))
            .unwrap();
        std::hint::black_box(blake3::hash(&out));
        out.len()
    });
    let read = best(&mut || decode(&out, Path::new("")).unwrap().len() * 28);
    let dir = tempfile::tempdir().unwrap();
    let disk = best(&mut || {
        let mut file = std::fs::File::create(dir.path().join("f")).unwrap();
        encode(&mut file, &STAMP, &particles).unwrap();
        file.sync_all().unwrap();
        out.len()
    });
    println!(
        "MB/s: packed {packed:.0}, per property {library:.0}, packed to disk \
         {disk:.0}, read {read:.0}"
    );
}
