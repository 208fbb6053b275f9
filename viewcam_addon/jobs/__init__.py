"""Work on one .blend: what is to be rendered and checked, and all that carries it out, with nothing lost on the way.

What is to be done
    job                   one picture, to be rendered, labeled or checked, and how: the one record of work, to JSON and back
    lists                 CSV, JSON and JSON Lines (docs/batch.md) → jobs, or all that is wrong with them
    makers                jobs by rule: an orbit, frames, cameras
    names                 what a shot, a job of several, may be called: its name is that of its files
    plan                  how several are carried out: where, by which processes, what is kept

Doing it, many shots of one file, each with a sidecar
    folder                what stands where, and whether a shot is there already
    one                   one shot, rendered, labeled, checked and written; what a renderer is
    run                   all of them: claimed, rendered, counted, through failures, full disks, signals and other batches
    locks, interruption   shared work; the first signal and the second
    summary, sheet        what it came to, as JSON and as a page of thumbnails
    dataset               what it came to, as those read it who learn a scene from its pictures
    check                 a check, or a comparison of files, as a call of Python

On child processes (../child_process.py)
    tracing                         renders the reference, compares, writes reports and labels
    served_renderer                 a renderer in a process of its own
    cluster, worker                 shots on several workers, each of which keeps such a process

**Nothing lost.** A file appears whole or not at all (files.py), and a shot's sidecar is written last and taken away first: a
shot is there if its sidecar is, whatever was killed when. All that a run decides it reads from the folder, so there is no
journal that could be wrong. Locks only share the work out; without them two batches would do it twice, and end with the same
bytes.

Nothing here knows Blender: what the .blend says (its cameras' names, a camera's pinhole, its content's hash) is handed in.
Rejected: a database of states (a second truth beside the files), and a folder per shot.
"""
