//! `freeswing completions`, `freeswing man`: what a shell and `man` know of the commands, from the same source as `--help`.

use std::path::PathBuf;

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Cli, Console, TrackCli};
use crate::error::{Error, Result};
use crate::output::{self, OutputFile};

/// Print a shell's completions of all commands.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing completions bash > ~/.local/share/bash-completion/completions/freeswing
  freeswing completions zsh > ~/.zfunc/_freeswing
  freeswing completions fish > ~/.config/fish/completions/freeswing.fish
  freeswing completions bash --of track > ~/.local/share/bash-completion/completions/track")]
pub struct CompletionsArgs {
    /// The shell.
    shell: Shell,
    /// Of which program.
    #[arg(long, value_name = "PROGRAM", default_value = "freeswing", value_parser = ["freeswing", "track"])]
    of: String,
}

impl CompletionsArgs {
    /// Prints them.
    ///
    /// # Errors
    /// [`Error::Unwritable`] for standard output.
    pub fn run(&self, console: &Console) -> Result<()> {
        let mut command = if self.of == "track" { TrackCli::command() } else { Cli::command() };
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut command, &self.of, &mut text);
        console.print(&String::from_utf8_lossy(&text))
    }
}

/// Write manual pages of all commands into a folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  freeswing man --out ~/.local/share/man/man1 && man freeswing-track")]
pub struct ManArgs {
    /// The folder; it is made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl ManArgs {
    /// Writes them.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn run(&self, _console: &Console) -> Result<()> {
        output::make_folder(&self.out)?;
        let mut whole = Cli::command();
        whole.build();
        self.page(whole.clone(), "freeswing".to_owned())?;
        for command in whole.get_subcommands().filter(|command| command.get_name() != "help") {
            self.page(command.clone(), format!("freeswing-{}", command.get_name()))?;
        }
        self.page(TrackCli::command(), "track".to_owned())
    }

    fn page(&self, command: clap::Command, name: String) -> Result<()> {
        let path = self.out.join(format!("{name}.1"));
        let mut text = Vec::new();
        let page = clap_mangen::Man::new(command.display_name(name.clone())).title(name.to_uppercase());
        page.render(&mut text).map_err(|e| Error::unwritable(&path, e))?;
        OutputFile::create(&path)?.commit(&text)
    }
}
