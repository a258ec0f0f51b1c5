//! GPUs that this machine seems to have although no driver offers them, and what to do about it.

use std::{collections::BTreeMap, env, fs, path::Path};

/// Makers of GPUs, whose drivers are installed differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Maker {
    Nvidia,
    Amd,
    Intel,
}

impl Maker {
    /// Maker of a PCI vendor number, as in `/sys/class/drm/renderD128/device/vendor`. Displays of
    /// virtual machines have other numbers.
    fn of_vendor(number: &str) -> Option<Self> {
        match number.trim() {
            "0x10de" => Some(Self::Nvidia),
            "0x1002" => Some(Self::Amd),
            "0x8086" => Some(Self::Intel),
            _ => None,
        }
    }

    /// What makes Vulkan show a GPU of this maker with this device file.
    fn advice(self, node: &str) -> String {
        let mesa = |name: &str, arch: &str| {
            format!(
                "for {node} ({name}) install Mesa's Vulkan drivers (Debian, Ubuntu and Fedora \
                 `mesa-vulkan-drivers`, Arch `{arch}`), and let this user open that file (group \
                 `render`)"
            )
        };
        match self {
            Self::Nvidia => format!(
                "for {node} (NVIDIA) install the driver's Vulkan part, whose nvidia_icd.json \
                 belongs in /etc/vulkan/icd.d or /usr/share/vulkan/icd.d, or is named by \
                 VK_DRIVER_FILES; a container gets it if it is started with \
                 NVIDIA_DRIVER_CAPABILITIES=compute,utility,graphics"
            ),
            Self::Amd => mesa("AMD", "vulkan-radeon"),
            Self::Intel => mesa("Intel", "vulkan-intel"),
        }
    }
}

/// What makes Vulkan show the GPUs whose device files this machine has; `None` if it has none.
/// Other systems than Linux have no such files, and their drivers are not installed apart.
pub(super) fn advice() -> Option<String> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    let overrides = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
    let is_set = |name: &&str| env::var_os(name).is_some_and(|value| !value.is_empty());
    advise(
        &found(Path::new("/")),
        overrides.into_iter().find(|name| is_set(name)),
    )
}

/// Advice for these GPUs; `hides` names an environment variable that replaces the list of drivers.
fn advise(found: &BTreeMap<Maker, String>, hides: Option<&str>) -> Option<String> {
    let advice = found.iter().map(|(maker, node)| maker.advice(node));
    let hides = hides.map(|name| format!("{name} is set, which hides all other drivers"));
    let all: Vec<String> = advice.chain(hides).collect();
    (!found.is_empty()).then(|| all.join("; "))
}

/// The first device file of each maker's GPUs, below the root of the file system.
fn found(root: &Path) -> BTreeMap<Maker, String> {
    let mut found = BTreeMap::new();
    let mut add = |maker, node| {
        found.entry(maker).or_insert(node);
    };
    for name in names(&root.join("dev")) {
        let number = name.strip_prefix("nvidia").unwrap_or_default();
        if !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()) {
            add(Maker::Nvidia, format!("/dev/{name}"));
        }
    }
    for name in names(&root.join("dev/dri")) {
        let vendor = root.join("sys/class/drm").join(&name).join("device/vendor");
        let vendor = fs::read_to_string(vendor).unwrap_or_default();
        if let (true, Some(maker)) = (name.starts_with("renderD"), Maker::of_vendor(&vendor)) {
            add(maker, format!("/dev/dri/{name}"));
        }
    }
    found
}

/// Names in a folder, sorted; none if it cannot be read.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;

    /// Advice on a machine with these files, given as path and text.
    fn advice_with(files: &[(&str, &str)], hides: Option<&str>) -> Option<String> {
        let root = tempfile::tempdir().unwrap();
        for (file, text) in files {
            let path = root.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        advise(&found(root.path()), hides)
    }

    #[test]
    fn device_files_of_gpus_give_advice_of_their_maker() {
        let nvidia = advice_with(&[("dev/nvidia1", ""), ("dev/nvidia0", "")], None).unwrap();
        assert!(nvidia.contains("/dev/nvidia0") && !nvidia.contains("nvidia1"));
        for words in ["nvidia_icd.json", "VK_DRIVER_FILES", "utility,graphics"] {
            assert!(nvidia.contains(words), "{nvidia}");
        }
        assert!(!nvidia.contains("mesa"), "{nvidia}");
        let vendor = "sys/class/drm/renderD128/device/vendor";
        for (number, name) in [("0x1002\n", "AMD"), ("0x8086\n", "Intel")] {
            let said = advice_with(&[("dev/dri/renderD128", ""), (vendor, number)], None);
            let said = said.unwrap();
            assert!(said.contains("mesa-vulkan-drivers") && said.contains(name));
            assert!(said.contains("/dev/dri/renderD128") && !said.contains("NVIDIA"));
        }
        let both = [
            ("dev/nvidia0", ""),
            ("dev/dri/renderD128", ""),
            (vendor, "0x1002\n"),
        ];
        let said = advice_with(&both, Some("VK_ICD_FILENAMES")).unwrap();
        assert!(
            said.contains("(NVIDIA)") && said.contains("(AMD)"),
            "{said}"
        );
        assert!(said.ends_with("VK_ICD_FILENAMES is set, which hides all other drivers"));
        assert!(!said.contains('\n'), "{said}");
    }

    /// Controls: no files, NVIDIA's files that are no GPU, the display of a virtual machine, and a
    /// card without a render node.
    #[test]
    fn without_a_gpus_device_file_there_is_no_advice() {
        let vendor = "sys/class/drm/renderD128/device/vendor";
        for files in [
            &[][..],
            &[("dev/nvidiactl", ""), ("dev/nvidia-uvm", "")],
            &[("dev/dri/renderD128", ""), (vendor, "0x1af4\n")],
            &[("dev/dri/renderD128", "")],
            &[("dev/dri/card0", ""), (vendor, "0x8086\n")],
        ] {
            assert_eq!(advice_with(files, Some("VK_DRIVER_FILES")), None);
        }
    }
}
