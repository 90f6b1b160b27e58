//! Errors as people see them: what is wrong, the lines it is about, why, and what could be done.

use crate::InputError;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::error::Error;

/// The text of an error: its message, the `place` it is about, the errors behind it, and a hint
/// if there is one; with or without the colours of a terminal.
pub fn shown(
    error: &dyn Error,
    place: Option<&InputError>,
    hint: Option<&str>,
    coloured: bool,
) -> String {
    let mut report = Level::ERROR
        .primary_title(error.to_string())
        .elements(place.map(picture));
    let mut cause = error.source();
    while let Some(error) = cause {
        report = report.element(Level::NOTE.no_name().message(error.to_string()));
        cause = error.source();
    }
    if let Some(hint) = hint {
        report = report.element(Level::HELP.message(hint));
    }
    let renderer = if coloured {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    renderer.render(&[report])
}

/// The lines of a file that an error is about.
fn picture(place: &InputError) -> Snippet<'_, annotate_snippets::Annotation<'_>> {
    let first = AnnotationKind::Primary
        .span(place.span.clone())
        .label(place.label.as_deref());
    let second = place.second.as_ref().map(|(span, label)| {
        AnnotationKind::Context
            .span(span.clone())
            .label(label.as_str())
    });
    Snippet::source(&*place.text)
        .path(place.path.as_str())
        .annotation(first)
        .annotations(second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, Source};
    use std::io;

    const FILE: &str = "[mesh]\nα = 1\n[laws]\nlaw = \"elastik\"\nlaw = 2\n";

    fn at(text: &str) -> std::ops::Range<usize> {
        let start = FILE.find(text).unwrap();
        start..start + text.len()
    }

    #[test]
    fn lines_are_shown_with_their_places_and_words() {
        let source = Source::new("case.toml", FILE);
        let error = source
            .error(at("\"elastik\""), "unknown law `elastik`")
            .label("here")
            .hint("did you mean `elastic`?");
        let error = source.mark(error, at("α"), "beside this");
        let shown = shown(&error, Some(&error), error.help(), false);
        assert_eq!(
            shown,
            "error: unknown law `elastik`
 --> case.toml:4:7
  |
2 | α = 1
  | - beside this
3 | [laws]
4 | law = \"elastik\"
  |       ^^^^^^^^^ here
  |
  = help: did you mean `elastic`?"
        );
    }

    #[test]
    fn causes_and_hints_follow_the_message() {
        let error = Error::unwritable("out".as_ref(), io::Error::other("the disk is full"));
        let plain = shown(&error, error.place(), error.help(), false);
        assert_eq!(
            plain,
            "error: cannot write out\n |\n = the disk is full\n \
             = help: name another place for the results on the command line"
        );
        let coloured = shown(&error, error.place(), error.help(), true);
        assert!(coloured.contains("\u{1b}[") && !plain.contains('\u{1b}'));
    }
}
