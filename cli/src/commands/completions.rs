//! `resample completions` and `resample man`: what shells and `man` need to know of the command line.

use anyhow::Result;
use clap::CommandFactory;

use crate::args::{Cli, CompletionsArgs, ManArgs};
use crate::output;

/// Prints the completions of a shell.
pub(crate) fn print(args: CompletionsArgs) {
    let mut command = Cli::command();
    clap_complete::generate(args.shell, &mut command, "resample", &mut std::io::stdout());
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

fn page(args: &ManArgs, command: &clap::Command, name: &str) -> Result<()> {
    let mut page = Vec::new();
    let titled = clap_mangen::Man::new(command.clone()).title(name);
    titled.render(&mut page)?;
    output::write_bytes(&args.folder.join(format!("{name}.1")), &page)?;
    Ok(())
}
