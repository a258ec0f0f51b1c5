//! Lints where a user meets them: said by inspect and by a bake, kept with the cache, and the end of either where they are denied.
use crate::support::job::{Job, assert_has};

#[test]
fn lints_are_warnings_unless_they_are_denied() {
    let job = Job::new();
    let lint = "wave_maker[0].motion: waves 0.02 m high are ";
    let set = "--set wave_maker=[{wall=\"-x\",motion={kind=\"solitary\",height=0.02,depth=1.0}}]";
    let words = |command: &str, rest: &str| format!("{command} small.toml {set} {rest}");
    assert_has(&job.expect(0, &words("inspect", "")), &["warning: ", lint]);
    let bake = "--device cpu --frames 1 -o";
    for command in [
        words("inspect", "--deny lint"),
        words("bake", &format!("{bake} denied --deny lint")),
    ] {
        let said = job.expect(2, &command);
        assert_has(&said, &["small.toml: denied by --deny lint:", lint]);
    }
    assert!(!job.path("denied").exists());
    assert_has(
        &job.expect(0, &words("bake", &format!("{bake} told"))),
        &["warning: ", lint],
    );
    assert_has(&job.expect(0, "inspect told"), &["warning: ", lint]);
    // Nothing to deny.
    job.expect(0, "inspect small.toml --deny lint");
}
