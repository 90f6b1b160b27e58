//! Commands and their options, from their help.

use super::{bless, filled, marks, page, printed};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;

/// The help of a command: how it is used, and what it lists with the text of each.
struct Help {
    usage: String,
    listed: Vec<(String, String)>,
}

impl Help {
    fn of(command: &str) -> Self {
        let help = match command {
            "pilum" => printed(&["--help"]),
            name => printed(&["help", name]),
        };
        let (mut usage, mut listed) = (String::new(), Vec::<(String, String)>::new());
        for line in help.lines() {
            let rest = line.trim_start();
            let indent = line.len() - rest.len();
            if let Some(text) = line.strip_prefix("Usage: ") {
                text.clone_into(&mut usage);
            } else if (1..=6).contains(&indent) {
                let (name, text) = rest.split_once("  ").unwrap_or((rest, ""));
                listed.push((name.to_owned(), text.trim().to_owned()));
            } else if indent > 6 && !["", "Possible values:"].contains(&rest) {
                let (_, text) = listed.last_mut().unwrap();
                let words: Vec<_> = rest.split_whitespace().collect();
                let (gap, words) = match words.as_slice() {
                    ["-", value, words @ ..] => {
                        write!(text, "<br>`{}`:", value.trim_end_matches(':')).unwrap();
                        (" ", words)
                    }
                    words if text.is_empty() => ("", words),
                    words => (" ", words),
                };
                write!(text, "{gap}{}", words.join(" ")).unwrap();
            }
        }
        Self { usage, listed }
    }

    /// The commands that it lists, with their texts.
    fn commands(&self) -> impl Iterator<Item = &(String, String)> {
        let is_command = |(name, _): &&(String, String)| !name.starts_with('-') && name != "help";
        self.listed.iter().filter(is_command)
    }

    /// Options and arguments.
    fn options(&self) -> impl Iterator<Item = &(String, String)> {
        let is_option = |(name, _): &&(String, String)| name.starts_with(['-', '<', '[']);
        self.listed.iter().filter(is_option)
    }
}

/// The tables of all commands by name. What is common to all is on top; what an earlier command says at length
/// is a link.
fn tables_of_commands() -> BTreeMap<String, String> {
    const LONG: usize = 70;
    let all = Help::of("pilum");
    let mut top = "| command | |\n|---|---|\n".to_owned();
    for (name, text) in all.commands() {
        writeln!(top, "| [`{name}`](#pilum-{name}) | {text} |").unwrap();
    }
    top += "\n| option of every command | |\n|---|---|\n";
    for (name, text) in all.options() {
        writeln!(top, "| `{name}` | {text} |").unwrap();
    }
    let of_all: BTreeSet<&str> = all.options().map(|(name, _)| name.as_str()).collect();
    let mut tables = BTreeMap::from([("pilum".to_owned(), top)]);
    let mut first: BTreeMap<(String, String), &str> = BTreeMap::new();
    for (command, _) in all.commands() {
        let help = Help::of(command);
        let mut table = format!("| `{}` | |\n|---|---|\n", help.usage);
        for (name, text) in help.options() {
            if of_all.contains(name.as_str()) {
                continue;
            }
            let option = (name.clone(), text.clone());
            match first.get(&option).filter(|_| text.len() > LONG) {
                Some(other) => writeln!(table, "| `{name}` | as [`{other}`](#pilum-{other}) |"),
                None => writeln!(table, "| `{name}` | {text} |"),
            }
            .unwrap();
            first.entry(option).or_insert(command);
        }
        tables.insert(command.clone(), table);
    }
    tables
}

#[test]
fn commands_are_those_of_the_program() {
    let path = page("commands.md");
    let text = fs::read_to_string(&path).unwrap();
    let listed: Vec<_> = marks(&text, "help")
        .into_iter()
        .map(|(_, name)| name)
        .collect();
    let mut wanted = vec!["pilum".to_owned()];
    wanted.extend(Help::of("pilum").commands().map(|(name, _)| name.clone()));
    assert_eq!(listed, wanted, "commands of {}", path.display());
    let tables = tables_of_commands();
    bless(&path, &filled(&text, "help", |name| tables[name].clone()));
}
