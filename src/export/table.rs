//! Writes particles as tables: NumPy's NPY, CSV, and Houdini's classic BGEO.

use std::fmt::Write as _;

use glam::DVec3;

use swell_domain::particles::Particles;

/// World position of a particle, metres; `origin` is the scene's.
fn world(particles: &Particles, index: usize, origin: DVec3) -> DVec3 {
    origin + DVec3::from_array(particles.position[index].map(f64::from))
}

/// Writes NPY 1.0: an array of records `position` (3 `<f4`, or `<f8` for a scene with an origin of
/// its own), `velocity` (3 `<f4`), `id` (`<u4`) and each attribute (`<f4`).
pub fn npy(particles: &Particles, origin: DVec3) -> Vec<u8> {
    let is_far = origin != DVec3::ZERO;
    let place = if is_far { "<f8" } else { "<f4" };
    let mut kinds =
        format!("('position', '{place}', (3,)), ('velocity', '<f4', (3,)), ('id', '<u4')");
    for name in particles.attributes.keys() {
        let _ = write!(kinds, ", ('{name}', '<f4')");
    }
    let mut header = format!(
        "{{'descr': [{kinds}], 'fortran_order': False, 'shape': ({},), }}",
        particles.len()
    );
    // Magic, version, header length, and the header with its line end fill a multiple of 64 bytes.
    const BEFORE: usize = 10;
    let filled = (BEFORE + header.len() + 1).next_multiple_of(64);
    header.extend(std::iter::repeat_n(' ', filled - BEFORE - header.len() - 1));
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    for index in 0..particles.len() {
        let place = world(particles, index, origin).to_array();
        match is_far {
            true => place
                .iter()
                .for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
            false => put(&mut out, &particles.position[index]),
        }
        put(&mut out, &particles.velocity[index]);
        out.extend_from_slice(&particles.id[index].to_le_bytes());
        for column in particles.attributes.values() {
            out.extend_from_slice(&column[index].to_le_bytes());
        }
    }
    out
}

fn put(out: &mut Vec<u8>, values: &[f32]) {
    for x in values {
        out.extend_from_slice(&x.to_le_bytes());
    }
}

/// Writes CSV with one row per particle and the columns `id,x,y,z,vx,vy,vz` and the attributes;
/// numbers have enough digits to restore their bits.
pub fn csv(particles: &Particles, origin: DVec3) -> Vec<u8> {
    let mut out = "id,x,y,z,vx,vy,vz".to_owned();
    for name in particles.attributes.keys() {
        let _ = write!(out, ",{name}");
    }
    out.push('\n');
    for index in 0..particles.len() {
        let [x, y, z] = particles.position[index];
        let [u, v, w] = particles.velocity[index];
        // Writing to a String cannot fail.
        let _ = match origin == DVec3::ZERO {
            true => write!(out, "{},{x},{y},{z}", particles.id[index]),
            false => {
                let p = world(particles, index, origin);
                write!(out, "{},{},{},{}", particles.id[index], p.x, p.y, p.z)
            }
        };
        let _ = write!(out, ",{u},{v},{w}");
        for column in particles.attributes.values() {
            let _ = write!(out, ",{}", column[index]);
        }
        out.push('\n');
    }
    out.into_bytes()
}

/// Attribute types of BGEO.
mod kind {
    pub(super) const FLOAT: u32 = 0;
    pub(super) const INT: u32 = 1;
    pub(super) const VECTOR: u32 = 5;
}

/// Writes Houdini's classic binary geometry, version 5, big-endian: points with `v`, `id` and the
/// attributes; no primitives. Coordinates have 32 bits.
pub fn bgeo(particles: &Particles, origin: DVec3) -> Vec<u8> {
    let mut out = b"BgeoV".to_vec();
    let word = |out: &mut Vec<u8>, x: u32| out.extend_from_slice(&x.to_be_bytes());
    word(&mut out, 5);
    let attributes = 2 + particles.attributes.len() as u32;
    // Points, primitives, groups of both; attributes of points, vertices, primitives and
    // the detail.
    for count in [particles.len() as u32, 0, 0, 0, attributes, 0, 0, 0] {
        word(&mut out, count);
    }
    let name = |out: &mut Vec<u8>, name: &str, size: u16, kind: u32| {
        out.extend_from_slice(&(name.len() as u16).to_be_bytes());
        out.extend_from_slice(name.as_bytes());
        out.extend_from_slice(&size.to_be_bytes());
        out.extend_from_slice(&kind.to_be_bytes());
        // Default values.
        out.extend(std::iter::repeat_n(0, 4 * usize::from(size)));
    };
    name(&mut out, "v", 3, kind::VECTOR);
    name(&mut out, "id", 1, kind::INT);
    for attribute in particles.attributes.keys() {
        name(&mut out, attribute, 1, kind::FLOAT);
    }
    for index in 0..particles.len() {
        let place = world(particles, index, origin).as_vec3().to_array();
        let columns = particles.attributes.values().map(|column| column[index]);
        let floats = place.into_iter().chain([1.0]);
        for x in floats.chain(particles.velocity[index]) {
            out.extend_from_slice(&x.to_be_bytes());
        }
        out.extend_from_slice(&particles.id[index].to_be_bytes());
        for x in columns {
            out.extend_from_slice(&x.to_be_bytes());
        }
    }
    // No detail attributes, and the end of the data after the primitives.
    out.extend_from_slice(&[0x00, 0xff]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Particles {
        Particles {
            position: vec![[0.1, 2.0, -3.5], [1e-7, 5.0, 6.0]],
            velocity: vec![[1.0, 0.0, -1.0], [0.25, 0.5, 0.75]],
            id: vec![3, 70000],
            attributes: [("age".to_owned(), vec![0.5, 1.5])].into(),
            ..Particles::default()
        }
    }

    #[test]
    fn a_table_gives_its_bits_back() {
        let text = String::from_utf8(csv(&two(), DVec3::ZERO)).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("id,x,y,z,vx,vy,vz,age"));
        let row: Vec<f32> = lines
            .nth(1)
            .unwrap()
            .split(',')
            .map(|x| x.parse().unwrap())
            .collect();
        assert_eq!(row, [70000.0, 1e-7, 5.0, 6.0, 0.25, 0.5, 0.75, 1.5]);
        let far = csv(&two(), DVec3::new(1e6, 0.0, 0.0));
        assert!(String::from_utf8(far).unwrap().contains("\n3,1000000.1"));
    }

    #[test]
    fn an_npy_has_the_rows_that_its_header_promises() {
        for (origin, row) in [(DVec3::ZERO, 32), (DVec3::X, 44)] {
            let bytes = npy(&two(), origin);
            let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            assert_eq!((10 + length) % 64, 0);
            assert_eq!(bytes.len(), 10 + length + 2 * row);
            assert_eq!(bytes[bytes.len() - 4..], 1.5f32.to_le_bytes());
        }
    }

    #[test]
    fn a_bgeo_has_its_points_behind_its_names() {
        let bytes = bgeo(&two(), DVec3::ZERO);
        assert_eq!(&bytes[..9], b"BgeoV\0\0\0\x05");
        assert_eq!(bytes[9..13], 2u32.to_be_bytes());
        // Four coordinates, velocity, id and age.
        let rows = &bytes[bytes.len() - 2 - 2 * 36..];
        assert_eq!(rows[..4], 0.1f32.to_be_bytes());
        assert_eq!(rows[36 + 28..36 + 32], 70000u32.to_be_bytes());
    }
}
