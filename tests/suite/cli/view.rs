//! `swell view` as a user runs it: what it shows, and what it refuses.

use std::{fs, path::Path};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::Value;
use swell::{
    cache::CacheReader,
    render::{
        Attributes, Image,
        image::{read_png, write_exr, write_png_with_attributes},
        view::apply,
    },
    scene::look::{ViewSpec, Window},
    study::rgb::Rgb,
};

use crate::support::{
    job::{Job, assert_has},
    made_cache::{Made, write_cache},
};

/// A picture whose every pixel differs from that of any other frame or folder.
fn picture(size: [usize; 2], frame: u32, folder: u8) -> Rgb {
    let pixel = |k: usize| {
        let (x, y) = (k % size[0], k / size[0]);
        [frame as u8 * 5, (x * 3 + y) as u8, folder]
    };
    Rgb {
        size,
        pixels: (0..size[0] * size[1]).map(pixel).collect(),
    }
}

fn write(job: &Job, folder: &str, frames: impl Iterator<Item = u32>, size: [usize; 2]) {
    fs::create_dir_all(job.path(folder)).unwrap();
    for frame in frames {
        let png = picture(size, frame, folder.len() as u8)
            .to_png("a test")
            .unwrap();
        fs::write(job.path(folder).join(format!("shot.{frame:04}.png")), png).unwrap();
    }
}

/// Twelve frames of 64 × 36 pixels.
fn made() -> Job {
    let job = Job::of(&[]);
    write(&job, "day", 1..=12, [64, 36]);
    job
}

fn decoded(bytes: &[u8]) -> Rgb {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    Rgb {
        size: [info.width as usize, info.height as usize],
        pixels: pixels.as_chunks().0.to_vec(),
    }
}

/// The data that the page's script reads.
fn data(page: &Path) -> Value {
    let text = fs::read_to_string(page).unwrap();
    let begin = text.find("id=\"data\">").unwrap() + "id=\"data\">".len();
    serde_json::from_str(text[begin..].split("</script>").next().unwrap()).unwrap()
}

/// Pictures of a page, one list per folder.
fn shown(page: &Path) -> Vec<Vec<Rgb>> {
    let bytes = |address: &Value| {
        let address = address.as_str().unwrap();
        match address.strip_prefix("data:image/png;base64,") {
            Some(text) => STANDARD.decode(text).unwrap(),
            None => fs::read(page.with_file_name(address)).unwrap(),
        }
    };
    let data = data(page);
    let sets = data["sets"].as_array().unwrap().iter();
    sets.map(|set| {
        let pictures = set["pictures"].as_array().unwrap().iter();
        pictures.map(|address| decoded(&bytes(address))).collect()
    })
    .collect()
}

#[test]
fn a_folder_becomes_a_sheet_and_a_page() {
    let job = made();
    let said = job.expect(0, "view day");
    assert_has(
        &said,
        &[
            "12 frames of 64 × 36",
            "contact sheet: views/day/sheet.png",
            "player: views/day/index.html",
        ],
    );
    let page = job.path("views/day/index.html");
    let frames = shown(&page);
    let wanted: Vec<Rgb> = (1..=12).map(|k| picture([64, 36], k, 3)).collect();
    assert_eq!(frames, std::slice::from_ref(&wanted));
    assert_ne!(frames[0][3], wanted[4], "the control");
    assert_eq!(data(&page)["labels"][11], "12");
    assert_eq!(data(&page)["rate"], 24.0);
    // Two rows of six pictures, each above its number.
    let sheet = decoded(&fs::read(job.path("views/day/sheet.png")).unwrap());
    let at = |k: usize| {
        let [x, y] = [16 + k % 6 * 80, 58 + k / 6 * 74];
        let row = |row: usize| sheet.pixels[(y + row) * sheet.size[0] + x..][..64].to_vec();
        (0..36).flat_map(row).collect::<Vec<_>>()
    };
    for (k, picture) in wanted.iter().enumerate() {
        assert!(at(k) == picture.pixels, "{k}");
    }
    assert!(at(2) != wanted[3].pixels, "the control");
    // Again: our own files are rewritten, and nothing else is left.
    job.expect(0, "view day --pictures beside");
    assert_eq!(shown(&page), [wanted]);
    assert!(job.path("views/day/pictures/a.0012.png").is_file());
    job.expect(0, "view day --frames 3");
    let left = fs::read_dir(job.path("views/day")).unwrap().count();
    assert_eq!(left, 2);
}

#[test]
fn frames_and_sheets_are_chosen() {
    let job = made();
    let said = job.expect(
        0,
        "view day --player --frames 2-8x3 --fps 12.5 --width 32 -o out",
    );
    assert!(
        !said.contains("frames a second") && !job.path("out/sheet.png").exists(),
        "{said}"
    );
    let page = job.path("out/index.html");
    let data = data(&page);
    assert_eq!(data["labels"], serde_json::json!(["2", "5", "8"]));
    assert_eq!(data["rate"], 12.5);
    let wanted = [2, 5, 8].map(|k| picture([64, 36], k, 3).resized([32, 18]));
    assert_eq!(shown(&page), [wanted.to_vec()]);
    let said = job.expect(0, "view day --sheet=4 -o some");
    assert!(!job.path("some/index.html").exists(), "{said}");
    let sheet = decoded(&fs::read(job.path("some/sheet.png")).unwrap());
    let red = |k: usize| sheet.pixels[60 * sheet.size[0] + 20 + k * 80][0];
    assert_eq!([red(0), red(1), red(2), red(3)], [5, 4 * 5, 8 * 5, 12 * 5]);
}

#[test]
fn a_movie_is_the_frames_in_turn() {
    let job = made();
    let said = job.expect(0, "view day --movie day.apng --fps 30");
    assert!(
        said.contains("movie: day.apng") && !job.path("views").exists(),
        "{said}"
    );
    let bytes = fs::read(job.path("day.apng")).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 12);
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    for frame in 1..=12 {
        reader.next_frame(&mut pixels).unwrap();
        assert!(
            pixels == picture([64, 36], frame, 3).pixels.as_flattened(),
            "{frame}"
        );
        let control = reader.info().frame_control().unwrap();
        assert_eq!((control.delay_num, control.delay_den), (1, 30));
    }
}

#[test]
fn two_folders_share_their_frames() {
    let job = made();
    write(&job, "dusk", 4..=20, [32, 18]);
    let said = job.expect(0, "view day dusk --movie both.apng --player --sheet");
    assert_has(
        &said,
        &[
            "9 frames of 64 × 36",
            "3 of the 12 frames of day",
            "8 of the 17 frames of dusk",
        ],
    );
    let page = job.path("views/day-vs-dusk/index.html");
    let frames = shown(&page);
    let of = |size, folder: &str| -> Vec<Rgb> {
        (4..=12)
            .map(|k| picture(size, k, folder.len() as u8))
            .collect()
    };
    assert_eq!(frames, [of([64, 36], "day"), of([32, 18], "dusk")]);
    let movie = decoded(&fs::read(job.path("both.apng")).unwrap());
    let dusk = picture([32, 18], 4, 4).resized([64, 36]);
    assert_eq!(movie, picture([64, 36], 4, 3).beside(&dusk));
    // Folders with the same name are distinguished.
    write(&job, "a/day", 1..=3, [64, 36]);
    job.expect(0, "view day a/day --player -o out");
    let names = data(&job.path("out/index.html"));
    assert_eq!(names["sets"][1]["name"], "a/day");
    write(&job, "tall", 1..=3, [36, 64]);
    let said = job.expect(2, "view day tall");
    assert!(said.contains("64 × 36 and tall is 36 × 64"), "{said}");
    write(&job, "late", 30..=31, [64, 36]);
    let said = job.expect(2, "view day late");
    assert!(said.contains("no frame in common"), "{said}");
}

/// Half light, half coverage, in a window of a larger image.
fn light() -> Image {
    let window = Window {
        corner: [2, 1],
        size: [3, 2],
    };
    let mut image = Image::of(window, [8, 4]);
    for (k, pixel) in image.beauty.iter_mut().enumerate() {
        *pixel = [0.05 * k as f32, 0.2, 0.5, 1.0];
    }
    image
}

#[test]
fn light_is_shown_through_a_view() {
    let job = Job::of(&[(
        "look.toml",
        &format!(
            "{}\n[view]\nexposure_stops = 1.0\ntransform = \"srgb\"\n",
            crate::support::job::LOOK
        ),
    )]);
    fs::create_dir(job.path("exr")).unwrap();
    let image = light();
    write_exr(
        &job.path("exr/shot.0001.exr"),
        &image,
        &Attributes::default(),
    )
    .unwrap();
    let plain = ViewSpec::default();
    let look = swell::files::load_look(&job.path("look.toml")).unwrap();
    let wanted = |view: &ViewSpec| {
        let pixel = |p: &[f32; 4]| {
            // Half floats keep 11 bits.
            let half = |x: f32| half::f16::from_f32(x).to_f32();
            match p[3] {
                0.0 => [0; 3],
                _ => apply(view, [half(p[0]), half(p[1]), half(p[2])])
                    .map(|x| (x * 255.0).round() as u8),
            }
        };
        image.shown().iter().map(pixel).collect::<Vec<_>>()
    };
    let said = job.expect(0, "view exr --player -o plain");
    assert!(said.contains("a look that does not set one"), "{said}");
    let frames = shown(&job.path("plain/index.html"));
    assert_eq!(frames[0][0].size, [8, 4]);
    assert_eq!(frames[0][0].pixels, wanted(&plain));
    job.expect(0, "view exr --player --look look.toml -o looked");
    let frames = shown(&job.path("looked/index.html"));
    assert_eq!(frames[0][0].pixels, wanted(&look.spec().view));
    assert_ne!(wanted(&plain), wanted(&look.spec().view), "the control");
    // A PNG of the same frame already has its look applied, and takes precedence.
    let png = picture([8, 4], 9, 9).to_png("a test").unwrap();
    fs::write(job.path("exr/shot.0001.png"), png).unwrap();
    job.expect(0, "view exr --player -o png");
    assert_eq!(
        shown(&job.path("png/index.html"))[0][0],
        picture([8, 4], 9, 9)
    );
}

#[test]
fn curves_of_a_cache_stand_below_its_pictures() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::watched());
    write(&job, "day", 1..=4, [64, 36]);
    job.expect(0, "view day --curves cache");
    let page = job.path("views/day/index.html");
    let text = fs::read_to_string(&page).unwrap();
    // Two probes, and energy, speed and density error from the ledger.
    assert_eq!(text.matches("<figure").count(), 5);
    assert_has(
        &text,
        &[
            "small: near",
            "small: far",
            "small: energy",
            "data-across=\"[[0,0.0666",
        ],
    );
    let found = data(&page);
    assert_eq!(found["rate"], 60.0);
    for (k, time) in found["times"].as_array().unwrap().iter().enumerate() {
        assert_eq!(time.as_f64(), Some((k + 1) as f64 / 60.0));
    }
    // Pictures that are marked as made from this cache, and from another.
    let cache = CacheReader::open(&job.path("cache")).unwrap();
    let image = light();
    for (folder, hash) in [("own", cache.frame_hash(2).unwrap()), ("other", "0123")] {
        fs::create_dir(job.path(folder)).unwrap();
        let attributes = Attributes {
            frame: 2,
            cache_hash: hash.to_owned(),
            look_hash: "look".to_owned(),
            ..Attributes::default()
        };
        let file = job.path(folder).join("small.0002.png");
        write_png_with_attributes(&file, &image, &ViewSpec::default(), &attributes).unwrap();
        let said = job.expect(0, &format!("view {folder} --curves cache"));
        let is_told = said.contains("frame 2 of other was not drawn from cache");
        assert_eq!(is_told, folder == "other", "{said}");
    }
    let read = read_png(&job.path("own/small.0002.png")).unwrap();
    let over_black = |p: &[f32; 4]| [p[0], p[1], p[2]].map(|x| (x * p[3] * 255.0).round() as u8);
    let wanted: Vec<_> = read.2.iter().map(over_black).collect();
    assert_eq!(
        shown(&job.path("views/own/index.html"))[0][0].pixels,
        wanted
    );
}

/// Counts the pixels of a picture that are closer to white than to the background.
fn bright(picture: &Rgb) -> usize {
    picture
        .pixels
        .iter()
        .filter(|p| p.iter().all(|&x| x > 130))
        .count()
}

#[test]
fn a_cache_shows_its_particles() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::watched());
    let said = job.expect(0, "view cache");
    assert_has(
        &said,
        &[
            "5 frames of 960 × 720",
            "coloured by speed",
            "no render",
            "views/small-pbf/sheet.png",
        ],
    );
    let page = job.path("views/small-pbf/index.html");
    let data = data(&page);
    assert_eq!(data["labels"], serde_json::json!(["0", "1", "2", "3", "4"]));
    assert_eq!(data["rate"], 60.0);
    assert_eq!(
        fs::read_to_string(&page)
            .unwrap()
            .matches("<figure")
            .count(),
        5
    );
    // The block slides along x with 1 m/s, the fastest colour: 16.7 mm per frame. 2 m of the domain
    // with margins of 3 % are as high as wide; the picture is cropped to three quarters, so that
    // 720 − 57.6 rows are 2 m.
    let frames = &shown(&page)[0];
    let middle = |picture: &Rgb| {
        let white = picture
            .pixels
            .iter()
            .enumerate()
            .filter(|(_, p)| p[0] > 130);
        let places: Vec<f64> = white.map(|(k, _)| (k % 960) as f64).collect();
        places.iter().sum::<f64>() / places.len() as f64
    };
    let moved = middle(&frames[4]) - middle(&frames[0]);
    let hold = 4.0 / 60.0 * (720.0 - 57.6) / 2.0;
    assert!((moved - hold).abs() < 1.0, "{moved} {hold}");
    // From the side, 0.8 m by 1 m of balls without gaps, each darker towards its rim.
    let area = bright(&frames[0]) as f64 / (331.2 * 331.2);
    assert!((0.5..0.85).contains(&area), "{area}");
    // From above they are 0.8 m by 1 m too, and the domain is 2 m by 1 m.
    job.expect(0, "view cache --from top --frames 2 --player -o top");
    let top = &shown(&job.path("top/index.html"))[0][0];
    assert_eq!(top.size, [960, 509]);
    job.expect(
        0,
        "view cache --from corner --movie corner.apng --frames 1-3",
    );
    let said = job.expect(4, "view cache --frames 3-9");
    assert!(said.contains("frames 0 to 4, not 5"), "{said}");
}

#[test]
fn two_caches_share_place_colours_and_charts() {
    let job = Job::of(&[]);
    write_cache(&job.path("a"), &Made::watched());
    let fast = |_: u32, water: &mut swell::domain::particles::Particles| {
        water.velocity.fill([4.0, 0.0, 0.0]);
    };
    write_cache(
        &job.path("b"),
        &Made {
            spoil: &fast,
            last: 3,
            ..Made::watched()
        },
    );
    let said = job.expect(0, "view a b --player -o both");
    assert_has(
        &said,
        &["4 frames of", "1 of the 5 frames of a", "white (4.0 m/s"],
    );
    let page = job.path("both/index.html");
    let frames = shown(&page);
    // A quarter of the shared maximum speed is blue; a cache of its own shows the same speed white.
    assert!(bright(&frames[0][0]) == 0 && bright(&frames[1][0]) > 10_000);
    job.expect(0, "view a --player -o alone");
    assert!(
        bright(&shown(&job.path("alone/index.html"))[0][0]) > 10_000,
        "the control"
    );
    let text = fs::read_to_string(&page).unwrap();
    assert_eq!(text.matches("<figure").count(), 5);
    assert_has(&text, &["a kinetic", "b kinetic"]);
}

#[test]
fn a_damaged_cache_is_not_shown() {
    let job = Job::of(&[]);
    write_cache(&job.path("cache"), &Made::default());
    let file = job.path("cache/frames/small.0002.ply");
    let mut bytes = fs::read(&file).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&file, bytes).unwrap();
    let said = job.expect(4, "view cache");
    assert!(said.contains("small.0002.ply is damaged"), "{said}");
    job.expect(0, "view cache --frames 3-4");
}

#[test]
fn a_study_has_its_page_and_a_sheet() {
    let job = Job::of(&[]);
    fs::create_dir_all(job.path("studies/x/curves")).unwrap();
    fs::write(job.path("studies/x/results.csv"), "a,b\n").unwrap();
    let said = job.expect(4, "view studies/x");
    assert!(said.contains("the study is not finished"), "{said}");
    fs::write(job.path("studies/x/index.html"), "its page").unwrap();
    let said = job.expect(0, "view studies/x");
    assert_has(
        &said,
        &["has no pictures", "the study's page: studies/x/index.html"],
    );
    assert!(!job.path("views").exists());
    for (name, size) in [("one", [64, 36]), ("two", [700, 50])] {
        let png = picture(size, 9, 200).to_png("a test").unwrap();
        fs::write(job.path(&format!("studies/x/curves/{name}.png")), png).unwrap();
    }
    job.expect(0, "view studies/x");
    let sheet = decoded(&fs::read(job.path("views/x/sheet.png")).unwrap());
    assert_eq!(sheet.size[0], 16 + 2 * (320 + 16));
    let theirs = sheet.pixels.iter().filter(|p| p[0] == 45 && p[2] == 200);
    assert_eq!(theirs.count(), 64 * 36 + 320 * 23);
    assert_eq!(
        fs::read_to_string(job.path("studies/x/index.html")).unwrap(),
        "its page"
    );
    let said = job.expect(2, "view studies/x --movie x.apng");
    assert!(said.contains("a page and no frames"), "{said}");
}

#[test]
fn faults_of_view_are_one_line_with_exit_code() {
    let job = made();
    let clear = |code, words: &str, part: &str| job.expect_clear(code, words, part);
    fs::create_dir_all(job.path("empty")).unwrap();
    clear(2, "view empty", "nothing to view in empty");
    clear(2, "view .", "; within it there are ./day");
    clear(4, "view gone", "gone does not exist");
    clear(2, "view day/shot.0001.png", "is not a folder");
    clear(
        2,
        "view day --frames 11-13",
        "day has no picture of frame 13",
    );
    clear(
        2,
        "view day --movie day.gif",
        "a movie ends in .apng, .mp4 or .webm",
    );
    clear(
        2,
        "view day --movie day.mp4 --ffmpeg no-such-ffmpeg",
        "no-such-ffmpeg, which cannot be run",
    );
    clear(2, "view day --fps 0", "from 0.1 to 240");
    clear(4, "view day --curves gone", "gone does not exist");
    assert!(!job.path("views").exists() && !job.path("day.mp4.tmp").exists());
    write(&job, "day", 13..=13, [32, 36]);
    clear(2, "view day", "shot.0013.png is 32 × 36");
    fs::remove_file(job.path("day/shot.0013.png")).unwrap();
    fs::copy(
        job.path("day/shot.0001.png"),
        job.path("day/other.0001.png"),
    )
    .unwrap();
    clear(2, "view day", "two sequences, other.* and shot.*");
    fs::remove_file(job.path("day/other.0001.png")).unwrap();
    fs::copy(
        job.path("day/shot.0001.png"),
        job.path("day/shot.00001.png"),
    )
    .unwrap();
    clear(2, "view day", "are both frame 1");
    fs::remove_file(job.path("day/shot.00001.png")).unwrap();
    // Another program's files are not overwritten, and nothing is written into a cache.
    fs::create_dir(job.path("study")).unwrap();
    fs::write(job.path("study/index.html"), "a study").unwrap();
    clear(2, "view day -o study", "choose another folder (-o)");
    assert_eq!(
        fs::read_to_string(job.path("study/index.html")).unwrap(),
        "a study"
    );
    fs::write(job.path("study/sheet.png"), "mine").unwrap();
    clear(
        2,
        "view day --sheet -o study",
        "sheet.png was not made by a view",
    );
    write_cache(&job.path("cache"), &Made::default());
    clear(2, "view day -o cache/view", "in the cache");
    clear(2, "view day --movie cache/m.apng", "in the cache");
    job.expect(0, "view day");
}

#[test]
fn a_damaged_picture_ends_a_view_and_leaves_nothing_half_made() {
    let job = made();
    let file = job.path("day/shot.0007.png");
    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() - 30]).unwrap();
    let said = job.expect(
        4,
        "view day --movie m.apng --player --sheet --pictures beside",
    );
    assert!(said.contains("shot.0007.png"), "{said}");
    let left = fs::read_dir(job.path("views/day")).unwrap().count();
    assert!(left == 0 && !job.path("m.apng").exists() && !job.path("m.apng.tmp").exists());
    fs::write(&file, "no picture").unwrap();
    let said = job.expect(4, "view day");
    assert!(said.contains("shot.0007.png"), "{said}");
    fs::write(&file, whole).unwrap();
    job.expect(0, "view day");
}

#[cfg(unix)]
#[test]
fn an_encoder_gets_every_pixel_and_its_words_are_told() {
    use std::os::unix::fs::PermissionsExt as _;
    let job = made();
    let program = |name: &str, text: &str| {
        job.write(name, &format!("#!/bin/sh\n{text}\n"));
        fs::set_permissions(job.path(name), fs::Permissions::from_mode(0o755)).unwrap();
    };
    program(
        "keep",
        "for last; do :; done; echo \"$@\" >options; cat >\"$last\"",
    );
    job.expect(0, "view day --movie out.webm --ffmpeg ./keep --fps 23.976");
    let raw = fs::read(job.path("out.webm")).unwrap();
    let wanted: Vec<u8> = (1..=12)
        .flat_map(|k| picture([64, 36], k, 3).pixels.into_flattened())
        .collect();
    assert!(raw == wanted);
    let options = fs::read_to_string(job.path("options")).unwrap();
    assert_has(
        &options,
        &[
            "-video_size 64x36",
            "-framerate 23.976",
            "-c:v libvpx-vp9",
            "-f webm",
        ],
    );
    program("fail", "echo 'Unknown encoder' >&2; exit 1");
    let said = job.expect(4, "view day --movie late.mp4 --ffmpeg ./fail");
    assert!(
        said.contains("./fail could not write late.mp4: Unknown encoder"),
        "{said}"
    );
    assert!(!job.path("late.mp4").exists() && !job.path("late.mp4.tmp").exists());
}
