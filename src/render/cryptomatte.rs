//! Cryptomatte, specification 1.2.0 (Friedman and Jones 2015): which objects each pixel sees, and
//! the fraction that each covers.

use std::collections::{BTreeMap, BTreeSet};
use swell_domain::parallel;

/// Name of the Cryptomatte layer, and prefix of its channels.
pub const LAYER: &str = "CryptoObject";
/// Largest number of pairs of object and coverage written per pixel.
const MOST_RANKS: usize = 6;
/// Number of objects tracked per pixel. Beyond that, the object with the least coverage is dropped.
const SLOTS: usize = 8;

/// Object codes, as the materials of `ssfr_solid.wgsl`.
const WATER: u32 = 0;
const WALLS: u32 = 1;
const GROUND: u32 = 2;
/// Code of pixels without an object; within this module the code of spray, which covers others.
const SKY: u32 = 3;
/// Code of the first solid.
pub(super) const SOLIDS: u32 = 4;
/// Number of solids that have codes of their own.
pub(super) const MOST_SOLIDS: usize = (PALETTE - SOLIDS) as usize;
/// Code of the first wall or wave maker with its own colour.
pub(super) const PALETTE: u32 = 192;

/// MurmurHash3_x86_32 (Appleby 2011) with seed 0.
fn murmur3(bytes: &[u8]) -> u32 {
    let scrambled = |word: u32| {
        let word = word.wrapping_mul(0xcc9e_2d51).rotate_left(15);
        word.wrapping_mul(0x1b87_3593)
    };
    let word = |bytes: &[u8]| {
        let bytes = bytes.iter().rev();
        bytes.fold(0u32, |word, &byte| word << 8 | u32::from(byte))
    };
    let chunks = bytes.chunks_exact(4);
    let rest = chunks.remainder();
    let mut hash = chunks.fold(0u32, |hash, chunk| {
        let hash = (hash ^ scrambled(word(chunk))).rotate_left(13);
        hash.wrapping_mul(5).wrapping_add(0xe654_6b64)
    });
    hash ^= scrambled(word(rest));
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// Returns the id that represents a name in pixels: its hash reinterpreted as a float, adjusted so
/// that it is never infinite, NaN or denormal.
pub fn id_of(name: &str) -> f32 {
    let hash = murmur3(name.as_bytes());
    let is_special = matches!(hash >> 23 & 255, 0 | 255);
    f32::from_bits(hash ^ u32::from(is_special) << 23)
}

/// Bits of a name's id as eight hexadecimal digits.
fn hex_of(name: &str) -> String {
    format!("{:08x}", id_of(name).to_bits())
}

/// Cryptomatte layer of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matte {
    /// Names of all objects that may appear in the shot's pictures.
    pub names: Vec<String>,
    /// Id and coverage of each pixel, one list per rank, in order of decreasing coverage; zeros
    /// where a pixel has fewer objects.
    pub ranks: Vec<Vec<[f32; 2]>>,
}

impl Matte {
    /// Returns the names and values of the header's attributes.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let key = hex_of(LAYER);
        let attribute =
            |name: &str, value: String| (format!("cryptomatte/{}/{name}", &key[..7]), value);
        vec![
            attribute("name", LAYER.to_owned()),
            attribute("hash", "MurmurHash3_32".to_owned()),
            attribute("conversion", "uint32_to_float32".to_owned()),
            attribute("manifest", self.manifest()),
        ]
    }

    /// Manifest as ASCII JSON, because a header's text is ASCII.
    fn manifest(&self) -> String {
        let ids: BTreeMap<&str, String> = self
            .names
            .iter()
            .map(|name| (name.as_str(), hex_of(name)))
            .collect();
        let text = serde_json::to_string(&ids).unwrap_or_default();
        let mut ascii = String::new();
        for unit in text.encode_utf16() {
            match u8::try_from(unit) {
                Ok(byte) if byte.is_ascii() => ascii.push(char::from(byte)),
                _ => ascii += &format!("\\u{unit:04x}"),
            }
        }
        ascii
    }

    /// Channels of the layer by name, two ranks per group of RGBA: `CryptoObject00.R`,
    /// `CryptoObject00.G`, and so on.
    pub(super) fn channels(&self) -> Vec<(String, Vec<f32>)> {
        let mut channels = Vec::new();
        for (rank, pixels) in self.ranks.iter().enumerate() {
            let suffixes = [["R", "G"], ["B", "A"]][rank % 2];
            for (part, suffix) in suffixes.into_iter().enumerate() {
                let name = format!("{LAYER}{:02}.{suffix}", rank / 2);
                channels.push((name, pixels.iter().map(|pair| pair[part]).collect()));
            }
        }
        channels
    }
}

/// Makes the names of solids unique: appends a number where a name is already in use.
pub fn unique(given: &[String]) -> Vec<String> {
    let mut taken: BTreeSet<String> = ["water", "ground", "walls", "spray"]
        .map(str::to_owned)
        .into();
    let mut name = |given: &String| {
        let numbered = (2u32..).map(|number| format!("{given}.{number}"));
        let mut all = std::iter::once(given.clone()).chain(numbered);
        let free = all.find(|name| !taken.contains(name)).unwrap_or_default();
        taken.insert(free.clone());
        free
    };
    given.iter().map(&mut name).collect()
}

/// Coverage of each pixel by object, accumulated sample by sample.
#[derive(Clone, Debug)]
pub(super) struct Covers(Vec<[(u32, f32); SLOTS]>);

/// An unused slot.
const EMPTY: (u32, f32) = (u32::MAX, 0.0);

impl Covers {
    pub(super) fn new(pixels: usize) -> Self {
        Self(vec![[EMPTY; SLOTS]; pixels])
    }

    /// Adds a sample with its `weight` in the pixel's mean. `objects` holds for each pixel the code
    /// of the first visible object and the bits of the fraction that spray covers.
    pub(super) fn add(&mut self, objects: &[[u32; 2]], weight: f32) {
        parallel::for_each_mut(&mut self.0, |pixel, slots| {
            let [code, cover] = objects[pixel];
            let cover = f32::from_bits(cover);
            if cover > 0.0 {
                put(slots, SKY, weight * cover);
            }
            let code = if code >= PALETTE { WALLS } else { code };
            if code != SKY && cover < 1.0 {
                put(slots, code, weight * (1.0 - cover));
            }
        });
    }

    /// Converts the coverage to a Cryptomatte layer; walls and spray are objects only where the
    /// look has them.
    pub(super) fn matte(self, solids: &[String], has_walls: bool, has_spray: bool) -> Matte {
        let fixed = [
            (WATER, "water", true),
            (GROUND, "ground", true),
            (WALLS, "walls", has_walls),
            (SKY, "spray", has_spray),
        ];
        let fixed = fixed.iter().filter(|(.., is_there)| *is_there);
        let fixed = fixed.map(|&(code, name, _)| (code, name.to_owned()));
        let solids = (SOLIDS..).zip(solids.iter().cloned());
        let names: BTreeMap<u32, String> = fixed.chain(solids).collect();
        let ids: BTreeMap<u32, f32> = names
            .iter()
            .map(|(&code, name)| (code, id_of(name)))
            .collect();
        let count = names.len().min(MOST_RANKS).next_multiple_of(2);
        let sorted: Vec<[[f32; 2]; SLOTS]> =
            parallel::map_slice(&self.0, |&slots| sorted(slots, &ids));
        Matte {
            names: names.into_values().collect(),
            ranks: (0..count)
                .map(|rank| sorted.iter().map(|pairs| pairs[rank]).collect())
                .collect(),
        }
    }
}

/// Adds coverage of an object to a pixel. With all slots in use, replaces the object with the least
/// coverage if that is less.
fn put(slots: &mut [(u32, f32); SLOTS], code: u32, coverage: f32) {
    let known = slots.iter().position(|slot| slot.0 == code);
    let found = known.or_else(|| slots.iter().position(|slot| slot.0 == EMPTY.0));
    let least = |a: &usize, b: &usize| slots[*a].1.total_cmp(&slots[*b].1);
    let Some(at) = found.or_else(|| (0..SLOTS).min_by(least)) else {
        return;
    };
    if found.is_some() {
        slots[at] = (code, slots[at].1 + coverage);
    } else if coverage > slots[at].1 {
        slots[at] = (code, coverage);
    }
}

/// Ids and coverages in order of decreasing coverage, then of code.
fn sorted(mut slots: [(u32, f32); SLOTS], ids: &BTreeMap<u32, f32>) -> [[f32; 2]; SLOTS] {
    slots.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    slots.map(|(code, coverage)| ids.get(&code).map_or([0.0; 2], |&id| [id, coverage]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_murmurs() {
        // Test vectors of the hash's author (SMHasher) and of its users, seed 0.
        for (text, hash) in [
            ("", 0),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3(text.as_bytes()), hash, "{text:?}");
        }
        assert_ne!(murmur3(b"hellp"), 0x248b_fa47, "the control");
    }

    #[test]
    fn ids_are_those_of_the_reference_plugin() {
        // Values that `cryptomatte_utilities_tests.py` in the specification's repository prints.
        for (name, id) in [
            ("hello", 6.070_562_710_24e-17),
            ("cube", -4.084_619_125_19e15),
            ("sphere", 2.790_186_043_83e15),
            ("plane", 3.665_576_175_93e-11),
            ("равнина", -1.319_263_121_24e-25),
            ("mädchen", 6.236_129_821_16e25),
        ] {
            assert_eq!(id_of(name), id as f32, "{name}");
        }
    }

    #[test]
    fn no_id_is_infinite_nan_or_denormal() {
        // Two of 256 exponents are special, so many names hit one.
        let names = (0..100_000u32).map(|k| format!("object{k}"));
        let special = |bits: u32| matches!(bits >> 23 & 255, 0 | 255);
        let mut seen = 0;
        for name in names {
            seen += u32::from(special(murmur3(name.as_bytes())));
            assert!(id_of(&name).is_normal(), "{name}");
        }
        assert!(seen > 100, "{seen} names put it to the test");
    }

    #[test]
    fn samples_become_ranks() {
        let mut covers = Covers::new(2);
        let half = 0.5f32.to_bits();
        covers.add(&[[WATER, 0], [SKY, 0]], 0.5);
        covers.add(&[[SOLIDS, half], [WATER, 0]], 0.5);
        let solids = unique(&["pier".to_owned()]);
        let matte = covers.matte(&solids, false, true);
        assert_eq!(matte.names, ["water", "ground", "spray", "pier"]);
        let [water, spray, pier] = ["water", "spray", "pier"].map(id_of);
        let pixel =
            |k: usize| -> Vec<[f32; 2]> { matte.ranks.iter().map(|rank| rank[k]).collect() };
        // Of equal coverages, spray comes first.
        assert_eq!(
            pixel(0),
            [[water, 0.5], [spray, 0.25], [pier, 0.25], [0.0; 2]]
        );
        assert_eq!(pixel(1), [[water, 0.5], [0.0; 2], [0.0; 2], [0.0; 2]]);
        let channels: Vec<String> = matte.channels().into_iter().map(|(name, _)| name).collect();
        assert_eq!(channels[3..5], ["CryptoObject00.A", "CryptoObject01.R"]);
    }

    #[test]
    fn the_least_of_too_many_objects_gives_way() {
        let mut covers = Covers::new(1);
        for k in 0..10 {
            covers.add(&[[SOLIDS + k, 0]], 0.01 * (k + 1) as f32);
        }
        let names: Vec<String> = (0..10).map(|k| format!("s{k}")).collect();
        let matte = covers.matte(&names, false, false);
        let kept: Vec<f32> = matte.ranks.iter().map(|rank| rank[0][0]).collect();
        assert_eq!(kept, [9, 8, 7, 6, 5, 4].map(|k| id_of(&format!("s{k}"))));
    }

    #[test]
    fn names_are_unique_and_a_manifest_is_ascii() {
        let given = ["city", "water", "city", "mädchen"].map(str::to_owned);
        let names = unique(&given);
        assert_eq!(names, ["city", "water.2", "city.2", "mädchen"]);
        let matte = Matte {
            names,
            ..Matte::default()
        };
        let manifest = matte.manifest();
        assert!(
            manifest.is_ascii() && manifest.contains("m\\u00e4dchen"),
            "{manifest}"
        );
        let read: BTreeMap<String, String> = serde_json::from_str(&manifest).expect("JSON");
        assert_eq!(
            read["mädchen"],
            format!("{:08x}", id_of("mädchen").to_bits())
        );
        // The first seven digits of 3ae39a58, the hash of "CryptoObject".
        assert_eq!(matte.attributes()[0].0, "cryptomatte/3ae39a5/name");
    }
}
