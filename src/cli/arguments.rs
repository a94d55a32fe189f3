//! Arguments before a command runs: errors in one line, and no output that would overwrite an input or another output.

use std::ffi::OsString;
use std::ops::Deref;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{ArgMatches, CommandFactory, FromArgMatches};

use crate::error::{Error, Result};
use crate::output;

/// A file that a command writes. Every other path among its words is taken for one that it reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target(PathBuf);

impl From<OsString> for Target {
    fn from(word: OsString) -> Self {
        Self(word.into())
    }
}

impl Deref for Target {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

/// Options of this name draw, and what is drawn is SVG.
const FIGURE: &str = "figure";

/// Reads the words of a command. Help and version are printed, and the program ends.
///
/// # Errors
/// [`Error::Words`]; [`Error::Option`] where files would be overwritten.
pub fn read<C: CommandFactory + FromArgMatches>(
    words: impl IntoIterator<Item = impl Into<OsString> + Clone>,
) -> Result<C> {
    let mut command = with_negative_numbers(C::command());
    let matches = command.try_get_matches_from_mut(words).map_err(in_one_line)?;
    check_files(&matches)?;
    C::from_arg_matches(&matches).map_err(in_one_line)
}

/// A number below zero is a number, whatever an option makes of it, and not an option of its own.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let is_free = |arg: &clap::Arg| {
        arg.get_long().is_some() && arg.get_action().takes_values() && !arg.is_allow_hyphen_values_set()
    };
    let command = command.mut_args(|arg| if is_free(&arg) { arg.allow_negative_numbers(true) } else { arg });
    command.mut_subcommands(with_negative_numbers)
}

/// What clap says over several lines, without the summary of usage.
fn in_one_line(error: clap::Error) -> Error {
    if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        error.exit();
    }
    let text = error.to_string();
    let lines = text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage: "));
    let mut detail = String::new();
    for line in lines.filter(|line| !line.is_empty() && !line.starts_with("For more information")) {
        let line = line.trim_start_matches("error: ").trim_start_matches("tip: ");
        detail.push_str(match detail.chars().last() {
            None => "",
            Some(':') => " ",
            Some('>' | '.') => ", ",
            Some(_) => "; ",
        });
        detail.push_str(line);
    }
    Error::Words { detail }
}

/// The guard of all files that are named among the words.
fn check_files(matches: &ArgMatches) -> Result<()> {
    if let Some((_, matches)) = matches.subcommand() {
        return check_files(matches);
    }
    let mut inputs: Vec<&Path> = Vec::new();
    let mut outputs: Vec<(String, &Path)> = Vec::new();
    for id in matches.ids() {
        if let Ok(Some(paths)) = matches.try_get_many::<PathBuf>(id.as_str()) {
            inputs.extend(paths.map(PathBuf::as_path));
        }
        if let Ok(Some(targets)) = matches.try_get_many::<Target>(id.as_str()) {
            let option = format!("--{}", id.as_str().replace('_', "-"));
            outputs.extend(targets.map(|target| (option.clone(), &**target)));
        }
    }
    for (option, path) in outputs.iter().filter(|(option, _)| option.ends_with(FIGURE)) {
        check_figure(option, path)?;
    }
    refuse_overwriting(&inputs, &outputs, "use another name")
}

/// No output, with the option that names it, may take the place of an input or of another output.
///
/// # Errors
/// [`Error::Option`] with the remedy.
pub fn refuse_overwriting(inputs: &[&Path], outputs: &[(String, &Path)], remedy: &str) -> Result<()> {
    for (index, (option, output)) in outputs.iter().enumerate() {
        let refused = |why: &str| {
            let message = format!("{} is {why}; {remedy}", output.display());
            Err(Error::Option { option: option.clone(), message })
        };
        // standard input and standard output share a name, and nothing else
        if inputs.iter().any(|input| input.as_os_str() != "-" && output::is_same_target(input, output)) {
            return refused("an input and would be overwritten");
        }
        if let Some((other, _)) = outputs[..index].iter().find(|(_, other)| output::is_same_target(other, output)) {
            return refused(&format!("what {other} writes and would be overwritten"));
        }
    }
    Ok(())
}

/// A figure is SVG, which its name must say.
fn check_figure(option: &str, path: &Path) -> Result<()> {
    let is_svg = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    // standard output and devices have no extension
    if is_svg || path.as_os_str() == "-" || (path.exists() && !path.is_file()) {
        return Ok(());
    }
    let svg = path.with_extension("svg");
    let message = format!(
        "{}: figures are SVG; name it {}, which browsers and office programs open (`rsvg-convert {} -o x.png` makes a PNG of it)",
        path.display(),
        svg.display(),
        svg.display()
    );
    Err(Error::Option { option: option.to_owned(), message })
}

#[cfg(test)]
mod tests {
    use std::any::TypeId;

    use super::*;
    use crate::cli::{Cli, TrackCli};

    #[test]
    fn a_path_that_the_guard_takes_for_an_input_is_one() {
        let mut all = Cli::command();
        all.build();
        let track = TrackCli::command();
        for command in all.get_subcommands().chain([&track]) {
            for arg in command.get_opts().filter(|arg| arg.get_value_parser().type_id() == TypeId::of::<PathBuf>()) {
                let (option, kind) = (arg.get_long().unwrap(), arg.get_value_names().unwrap()[0].as_str());
                let is_read = ["config", "times", "mask"].contains(&option);
                assert!(
                    is_read || kind == "DIR",
                    "{} --{option}: a file that is written is a Target",
                    command.get_name()
                );
            }
        }
    }
}
