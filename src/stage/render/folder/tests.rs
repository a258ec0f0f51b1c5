use swell_files::parse_look;

use super::*;
use swell_render::{Image, image::write_png_with_attributes};

const LOOK: &str = r#"
[camera]
focal_length_mm = 35.0
film_back_mm = [36.0, 36.0]
position = [-2.0, 3.0, 2.5]
target = [0.0, 1.0, 0.75]
[image]
width = 4
height = 4
[sky]
model = "hosek_wilkie"
[sun]
azimuth_degrees = 120.0
elevation_degrees = 35.0
"#;

fn owner(look: &str) -> Owner {
    Owner {
        software: "swell 0.1.0".to_owned(),
        shot: "small".to_owned(),
        scene_hash: "5ce".to_owned(),
        cache: "first line".to_owned(),
        look_hash: look.to_owned(),
        numbering: 0,
    }
}

fn hash(frame: u32) -> Option<String> {
    (frame < 9).then(|| format!("b3 of {frame}"))
}

/// Enters for frames 1 and 2 as PNG.
fn enter_as(owner: Owner, folder: &Path, overwrite: bool) -> Result<Folder, FolderError> {
    let wanted = Wanted {
        owner,
        names: ["small.0001.png", "small.0002.png"]
            .map(str::to_owned)
            .into(),
        overwrite,
        frame_hash: &hash,
    };
    Folder::enter(folder, &wanted)
}

fn enter(look: &str, folder: &Path, overwrite: bool) -> Result<Folder, FolderError> {
    enter_as(owner(look), folder, overwrite)
}

fn is_in_use(result: Result<Folder, FolderError>) -> bool {
    matches!(result, Err(FolderError::InUse { .. }))
}

fn picture(file: &Path, frame: u32, edit: impl FnOnce(&mut Attributes)) {
    let mut attributes = Attributes {
        frame,
        shot: "small".to_owned(),
        software: "swell 0.1.0".to_owned(),
        scene_hash: "5ce".to_owned(),
        cache_hash: hash(frame).unwrap_or_default(),
        look_hash: "day".to_owned(),
    };
    edit(&mut attributes);
    let look = parse_look(LOOK, Path::new("look.toml")).unwrap();
    let image = Image::new(4, 4);
    write_png_with_attributes(file, &image, &look.spec().view, &attributes).unwrap();
}

#[test]
fn a_frame_is_claimed_by_one_until_it_lets_go() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [(); 2].map(|()| enter("day", folder.path(), false).unwrap());
    let claim = a.claim("small.0001").unwrap();
    assert!(claim.is_some());
    assert!(b.claim("small.0001").unwrap().is_none());
    assert!(a.claim("small.0001").unwrap().is_none());
    assert!(b.claim("small.0002").unwrap().is_some());
    drop(claim);
    assert!(b.claim("small.0001").unwrap().is_some());
}

#[test]
fn one_look_at_a_time_and_overwriting_alone() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    let day = enter("day", d, false).unwrap();
    let second = enter("day", d, false).unwrap();
    drop(day);
    assert!(d.join(ROOM).exists(), "one is still there");
    assert!(is_in_use(enter("dusk", d, false)));
    assert!(is_in_use(enter("dusk", d, true)));
    assert!(is_in_use(enter("day", d, true)));
    drop(second);
    assert!(!d.join(ROOM).exists());
    let alone = enter("day", d, true).unwrap();
    assert!(is_in_use(enter("day", d, false)));
    assert!(is_in_use(enter("day", d, true)));
    drop(alone);
    // Without pictures, there is nothing to mix with.
    drop(enter("dusk", d, false).unwrap());
    assert!(!d.join(ROOM).exists());
}

#[test]
fn what_the_dead_left_goes_and_what_is_not_ours_stays() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    fs::create_dir(d.join(ROOM)).unwrap();
    for name in [
        ".swell/work",
        ".swell/small.0001.png.tmp",
        "small.0001.png.tmp",
        "small.0002.exr.tmp",
        "other.0001.png.tmp",
        "small.txt.tmp",
        "notes.txt",
    ] {
        fs::write(d.join(name), "half").unwrap();
    }
    fs::write(d.join(RECORD), "{ \"software\": ").unwrap();
    let held = enter("day", d, false).unwrap();
    assert_eq!(names(&d.join(ROOM)).unwrap(), [WORK]);
    drop(held);
    let left = ["notes.txt", "other.0001.png.tmp", RECORD, "small.txt.tmp"];
    assert_eq!(names(d).unwrap(), left);
    let text = fs::read_to_string(d.join(RECORD)).unwrap();
    assert_eq!(serde_json::from_str::<Owner>(&text).unwrap(), owner("day"));
}

#[cfg(unix)]
#[test]
fn where_nothing_was_rendered_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let new = folder.path().join("new");
    drop(enter("day", &new, false).unwrap());
    assert!(!new.exists());
    drop(enter("day", folder.path(), false).unwrap());
    assert!(folder.path().exists() && names(folder.path()).unwrap().is_empty());
    // A picture stays, and so does the record of its owner.
    let held = enter("day", &new, false).unwrap();
    let mut draft = held.draft("small.0001.png");
    picture(draft.path(), 1, |_| ());
    draft.publish().unwrap();
    drop(held);
    assert_eq!(names(&new).unwrap(), ["render.json", "small.0001.png"]);
}

/// Reported before any frame is rendered, whether or not the folder is ours.
#[test]
fn a_folder_in_place_of_a_picture_is_refused_at_once() {
    for overwrite in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let d = folder.path();
        drop(enter("day", d, false).unwrap());
        picture(&d.join("small.0003.png"), 3, |_| ());
        fs::create_dir(d.join("small.0002.png")).unwrap();
        match enter("day", d, overwrite) {
            Err(FolderError::File(FileError { path, source })) => {
                assert_eq!(path, d.join("small.0002.png"));
                assert_eq!(source.kind(), io::ErrorKind::IsADirectory);
            }
            other => panic!("{other:?}"),
        }
        fs::remove_dir(d.join("small.0002.png")).unwrap();
        enter("day", d, overwrite).unwrap();
    }
}

/// Each property that the pictures of one folder share.
#[test]
fn a_picture_of_something_else_is_told_by_what_it_is() {
    type Edit = fn(&mut Attributes);
    let edits: [(&str, Edit); 7] = [
        ("of another shot", |a| a.shot.push('x')),
        ("of another scene", |a| a.scene_hash.push('x')),
        ("of another cache", |a| a.cache_hash.push('x')),
        ("of another look", |a| a.look_hash.push('x')),
        ("of another version of the program", |a| {
            a.software.push('x');
        }),
        ("of another set of shaders", |a| {
            a.software += " with shaders 5e4, not the shipped ones";
        }),
        ("of another set of shaders", |a| {
            a.software += ", of a cache baked with shaders 5e4, not the shipped ones";
        }),
    ];
    for (says, edit) in edits {
        for (name, frame) in [("small.0002.png", 2), ("small.0003.png", 3)] {
            let folder = tempfile::tempdir().unwrap();
            let (d, file) = (folder.path(), folder.path().join(name));
            picture(&file, frame, |_| ());
            drop(enter("day", d, false).unwrap());
            picture(&file, frame, edit);
            // In a folder of ours it is replaced if it is one of the wanted frames: a kill may have
            // left it.
            assert_eq!(enter("day", d, false).is_ok(), frame == 2, "{says}");
            fs::remove_file(d.join(RECORD)).unwrap();
            match enter("day", d, false) {
                Err(FolderError::Other { file, what }) => {
                    assert_eq!((file, what.as_str()), (d.join(name), says));
                }
                other => panic!("{says}: {other:?}"),
            }
            assert!(!d.join(RECORD).exists(), "refused with nothing written");
            match enter("day", d, true) {
                Ok(_) => assert_eq!(frame, 2, "{says}"),
                Err(FolderError::Left { file, what }) => {
                    assert_eq!((frame, file, what.as_str()), (3, d.join(name), says));
                }
                other => panic!("{says}: {other:?}"),
            }
        }
    }
    // For a frame that the cache does not have (yet), the cache cannot decide.
    let folder = tempfile::tempdir().unwrap();
    picture(&folder.path().join("small.0012.png"), 12, |_| ());
    drop(enter("day", folder.path(), false).unwrap());
}

#[test]
fn another_cache_at_work_is_told_by_its_first_frame() {
    let folder = tempfile::tempdir().unwrap();
    let day = enter("day", folder.path(), false).unwrap();
    let other = Owner {
        cache: "another line".to_owned(),
        ..owner("day")
    };
    match enter_as(other, folder.path(), false) {
        Err(FolderError::InUse { what, .. }) => assert_eq!(what, "another cache"),
        other => panic!("{other:?}"),
    }
    drop(day);
}
