//! `swell render --preview`

use serde_json::json;

use swell_files::load_look_with;
use swell_stage::render::{
    RenderRequest,
    preview::{PAGE, PreviewEvent, preview},
};

use super::{
    super::{
        Failure, bake, chain, count,
        interrupt::{self, Interrupt},
        output,
        progress::Progress,
    },
    RenderArgs,
};

pub(super) fn run(
    request: RenderRequest,
    args: &RenderArgs,
    progress: &Progress,
) -> Result<u8, Failure> {
    let interrupt = Interrupt::install_or_warn();
    let page = request.directory.join(PAGE);
    let load = &mut || load_look_with(&args.look, &args.set, bake::reach(args.allow_outside));
    preview(request, &args.look, load, interrupt.flag(), &mut |event| {
        tell(progress, event, &output::path(&page));
    })?;
    progress.finish();
    Ok(interrupt::EXIT_CODE as u8)
}

fn tell(progress: &Progress, event: PreviewEvent, page: &str) {
    match event {
        PreviewEvent::Ready {
            device,
            software_warning,
        } => {
            progress.warn_of_adapter(software_warning.as_deref());
            progress.say(
                &format!("on {device}\n{page} shows the frame; a signal ends this"),
                json!({ "event": "ready", "device": device, "page": page }),
            );
        }
        PreviewEvent::Shown {
            size: [width, height],
            samples,
            seconds,
            is_whole,
        } => progress.say(
            &format!(
                "{width} × {height}, {}  {seconds:.2} s",
                count(samples.into(), "sample")
            ),
            json!({
                "event": "shown", "width": width, "height": height, "samples": samples,
                "seconds": seconds, "whole": is_whole,
            }),
        ),
        PreviewEvent::Refused { error } => {
            let text = chain(&*error);
            progress.say(&text, json!({ "event": "refused", "error": text }));
        }
    }
}
