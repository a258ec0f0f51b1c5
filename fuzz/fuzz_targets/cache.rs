//! A cache folder with a manifest and a ledger, shared by two fuzz targets.
#![allow(dead_code, reason = "each target uses its part")]

use std::{fs, path::Path, sync::OnceLock};

use swell::cache::{CacheReader, survey};

/// A manifest as a bake writes it, in fewer lines.
pub const MANIFEST: &str = r#"{"format_version":2,"program":"swell","program_version":"0.1.0","shot":"a","scene_hash":"5c",
"solver":"pbf","device":"d","driver":"d","backend":"Vulkan","frames_per_second":60.0,"particle_spacing":0.1,
"rest_density":1000.0,"attributes":[],"start_particles":1,"probes":[{"name":"e","kind":"energy","at":[],
"columns":["kinetic_J"]}],"files":[{"file":"scene.toml","bytes":0,
"blake3":"af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262"}]}"#;

/// Contents of the ledger's line for frame 0.
pub fn first_line(manifest: &[u8]) -> Vec<u8> {
    line_of(
        manifest,
        "\"files\":{\"particles\":{\"file\":\"frames/a.0000.ply\",\"bytes\":1,\"blake3\":\"\"}},\
         \"rows\":{\"probes\":[[1.0]]}",
    )
}

/// [`MANIFEST`] in format version 1.
pub fn manifest_of_format_1() -> String {
    MANIFEST.replacen("\"format_version\":2", "\"format_version\":1", 1)
}

/// Contents of the ledger's line for frame 0, in format version 1.
pub fn first_line_of_format_1(manifest: &[u8]) -> Vec<u8> {
    line_of(
        manifest,
        "\"file\":\"frames/a.0000.ply\",\"bytes\":1,\"blake3\":\"\",\"probes\":[[1.0]]",
    )
}

fn line_of(manifest: &[u8], files: &str) -> Vec<u8> {
    format!(
        "{{\"frame\":0,\"particles\":1,{files},\
         \"manifest\":\"{}\",\
         \"clock\":{{\"frame\":0,\"time\":0.0,\"substeps\":0,\"steps\":0}},\"report\":null}}",
        blake3::hash(manifest).to_hex()
    )
    .into_bytes()
}

/// Opens and surveys a cache with this manifest and these ledger lines, chained as a bake chains
/// them.
pub fn read(manifest: &[u8], lines: &[Vec<u8>]) {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        // In memory where the machine has a memory file system.
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        folder.expect("a temporary folder")
    });
    let path = folder.path();
    let mut chain = blake3::hash(manifest);
    let mut ledger = Vec::new();
    for line in lines {
        let mut hasher = blake3::Hasher::new();
        hasher.update(chain.as_bytes());
        hasher.update(line);
        chain = hasher.finalize();
        ledger.extend_from_slice(line.strip_suffix(b"}").unwrap_or(line));
        ledger.extend_from_slice(format!(",\"chain\":\"{}\"}}\n", chain.to_hex()).as_bytes());
    }
    fs::write(path.join("scene.toml"), b"").expect("written");
    fs::write(path.join("manifest.json"), manifest).expect("written");
    fs::write(path.join("frames.jsonl"), ledger).expect("written");
    let _ = survey(path);
    if let Ok(reader) = CacheReader::open(path) {
        assert!(!reader.entries().is_empty() && reader.first_frame() <= reader.last_frame());
        for entry in reader.entries() {
            let _ = reader.read(entry.frame);
        }
    }
}
