//! `resample completions` and `resample man`: what shells and `man` need to know of the command line.

use anyhow::Result;
use clap::builder::PossibleValuesParser;
use clap::{Command, CommandFactory};
use volsplat::transfer::{ColourMap, Preset};

use crate::args::{Cli, CompletionsArgs, ManArgs};
use crate::output;

/// Prints the completions of a shell.
pub(crate) fn print(args: CompletionsArgs) {
    let mut command = Cli::command();
    let names: Vec<String> = command
        .get_subcommands()
        .map(|one| one.get_name().to_owned())
        .collect();
    for name in names {
        command = command.mut_subcommand(name, with_names);
    }
    clap_complete::generate(args.shell, &mut command, "resample", &mut std::io::stdout());
}

/// A command whose options for looks complete their names.
fn with_names(command: Command) -> Command {
    let presets = Preset::all().map(|preset| preset.name());
    let maps = ColourMap::names();
    let lists: [(&str, Vec<&'static str>); 2] =
        [("preset", presets.collect()), ("colormap", maps.collect())];
    let known = |command: &Command, name: &str| {
        let mut arguments = command.get_arguments();
        arguments.any(|argument| argument.get_id() == name)
    };
    lists.into_iter().fold(command, |command, (name, names)| {
        if !known(&command, name) {
            return command;
        }
        let parser = PossibleValuesParser::new(names);
        command.mut_arg(name, |argument| argument.value_parser(parser))
    })
}

/// Writes a manual page for the program and one for each command.
pub(crate) fn write_pages(args: &ManArgs) -> Result<()> {
    let mut program = Cli::command();
    program.build();
    output::check_writable(&args.folder.join("resample.1"))?;
    page(args, &program, "resample")?;
    for command in program.get_subcommands() {
        page(args, command, &format!("resample-{}", command.get_name()))?;
    }
    Ok(())
}

fn page(args: &ManArgs, command: &Command, name: &str) -> Result<()> {
    let mut page = Vec::new();
    let titled = clap_mangen::Man::new(command.clone()).title(name);
    titled.render(&mut page)?;
    output::write_bytes(&args.folder.join(format!("{name}.1")), &page)?;
    Ok(())
}
