//! What the help of a command must have, for the tests of the programs.

use clap::Command;

/// What is wrong with the help of a command and of those below it: without examples, or wider than 80 columns.
pub fn faults(mut root: Command) -> Vec<String> {
    root.build();
    let name = root.get_name().to_owned();
    of(&root, &name)
}

fn of(command: &Command, name: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let is_group = command.has_subcommands() && name.contains(' ');
    if !is_group && !examples.contains("Examples:\n") {
        faults.push(format!("{name} has no examples"));
    }
    // Examples as they are written, too: what is wrapped for them loses its columns.
    let help = format!("{examples}\n{}", command.clone().render_long_help());
    let long = help.lines().filter(|line| line.chars().count() > 80);
    faults.extend(long.map(|line| format!("{name}: {line}")));
    let below = command.get_subcommands().filter(|one| one.get_name() != "help");
    faults.extend(below.flat_map(|one| of(one, &format!("{name} {}", one.get_name()))));
    faults
}
