// SPDX-License-Identifier: GPL-3.0-or-later
// A Flamenco job type: bakes many .blend files, one a task, then sums up. Goes into the Manager's `scripts` folder.

const JOB_TYPE = {
    label: "PDM Radiosity Bake",
    settings: [
        { key: "files", type: "string", required: true, propargs: { name: "Files" },
          description: "Paths of .blend files, separated by semicolons" },
        { key: "folder", type: "string", subtype: "dir_path", required: true,
          description: "Where NAME.blend, NAME.json and summary.json go" },
        { key: "target_error", type: "float", default: 0.01, description: "Relative error of the light" },
        { key: "subdivide", type: "bool", default: false, description: "Subdivide meshes that are too coarse for it" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const files = settings.files.split(";").map(name => name.trim()).filter(name => name);
    if (!files.length) {
        throw "name at least one .blend file";
    }
    const last = bakeTask("summary", files, settings);
    for (const file of files) {
        const task = bakeTask(file.split(/[\\/]/).pop(), [file], settings);
        last.addDependency(task);
        job.addTask(task);
    }
    job.addTask(last);
}

// Done again after a worker was lost, a task goes on where it ended: what is done is not done again.
function bakeTask(name, files, settings) {
    const task = author.Task(name, "blender");
    let args = ["-b", "--command", "pdm", "bake", "--files"].concat(files);
    args = args.concat(["--folder", settings.folder, "--processes", "1", "--target-error", String(settings.target_error)]);
    if (settings.subdivide) {
        args.push("--subdivide");
    }
    task.addCommand(author.Command("exec", { exe: "{blender}", args: args }));
    return task;
}
