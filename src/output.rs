//! Atomic writing of files: nothing half-written is ever seen under the name that was asked for.
//!
//! A file is first written under another name beside its target, then renamed. A symbolic link at the target is
//! followed; a file that is read-only is refused, any other gets the mode that the umask gives. What is not a regular
//! file (`/dev/stdout`, a terminal, a pipe) is written straight. Data are handed to the operating system, not forced
//! onto the disk.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Read, Write};
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::{Error, Result};

/// Bytes collected before each call of the operating system.
const BUFFER: usize = 1 << 18;

/// More links in a row than this are taken for a loop; Linux draws the line at the same number.
const MAX_LINKS: usize = 40;

/// Writes the file `path` with what `fill` gives.
///
/// # Errors
/// [`Error::Io`] naming `path` if anything fails, `fill` included. Then nothing new is left behind, and a file
/// that was there before is unchanged.
///
/// ```
/// let path = std::env::temp_dir().join(format!("limitlab-doc-{}.txt", std::process::id()));
/// limitlab::output::write_file(&path, |out| writeln!(out, "42"))?;
/// assert_eq!(std::fs::read_to_string(&path).unwrap(), "42\n");
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn write_file(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let mut batch = Batch::default();
    batch.write(path, fill)?;
    batch.commit()
}

/// Checks before the work that [`write_file`] can write `path` after it: the folder is there and takes new files, and
/// what has the name already is neither a folder nor protected. Nothing is left behind. What is not a regular file is
/// not opened, for a reader may wait at its other end.
///
/// # Errors
/// [`Error::Io`] naming `path`, as [`write_file`] would give it.
pub fn check_target(path: &Path) -> Result<()> {
    let check = || match destination(path)? {
        Destination::Straight => Ok(()),
        Destination::Rename { folder, .. } => Temporary::create(&folder).map(drop),
    };
    check().map_err(|e| Error::io(path, "write", e))
}

/// Lets a read-only file be replaced by [`write_file`]: its owner may write to it from now on. Any other file is left as
/// it is.
///
/// # Errors
/// [`Error::Io`] naming `path`, if the file is not ours.
pub fn allow_replacing(path: &Path) -> Result<()> {
    let allow = || {
        let mut permissions = fs::metadata(path)?.permissions();
        if !permissions.readonly() {
            return Ok(());
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            permissions.set_mode(permissions.mode() | 0o200);
        }
        #[cfg(not(unix))]
        permissions.set_readonly(false);
        fs::set_permissions(path, permissions)
    };
    allow().map_err(|e| Error::io(path, "write", e))
}

/// Creates a folder and the folders above it, and makes sure that files can be written there; one that is there already
/// is fine.
///
/// # Errors
/// [`Error::Io`] naming the folder.
pub fn create_dir(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|e| Error::io(path, "create the folder", e))?;
    Temporary::create(path).map(drop).map_err(|e| Error::io(path, "write in the folder", e))
}

/// Gives up all that is not complete, as a process does that is about to end: removes the temporary files, and lets
/// nothing be written from now on. Returns the files that this process has completed, in order.
pub fn abandon() -> Vec<PathBuf> {
    let mut ledger = ledger();
    for path in ledger.temporary.drain(..) {
        // Nothing sensible is left to do if this fails too.
        let _ = fs::remove_file(path);
    }
    let complete = mem::take(&mut ledger.complete);
    mem::forget(ledger);
    complete
}

/// The files with other content that those of this process took the place of, in order and as they were named.
pub fn replaced() -> Vec<PathBuf> {
    ledger().replaced.clone()
}

/// Whether this process has written the file.
pub fn is_complete(path: &Path) -> bool {
    match destination(path) {
        Ok(Destination::Rename { folder, name }) => ledger().complete.contains(&folder.join(name)),
        Ok(Destination::Straight) | Err(_) => false,
    }
}

/// What this process has put on the disk.
struct Ledger {
    temporary: Vec<PathBuf>,
    complete: Vec<PathBuf>,
    /// Of the complete ones, those that took the place of a file with other content, as they were asked for.
    replaced: Vec<PathBuf>,
}

/// The one ledger. It is locked while a temporary file comes and while it goes, so that it always tells the truth.
fn ledger() -> MutexGuard<'static, Ledger> {
    static LEDGER: Mutex<Ledger> =
        Mutex::new(Ledger { temporary: Vec::new(), complete: Vec::new(), replaced: Vec::new() });
    LEDGER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Several files that appear together: each [`write`](Batch::write) fills one out of sight,
/// [`commit`](Batch::commit) gives all of them their names. A batch dropped before leaves nothing behind.
#[derive(Default)]
pub struct Batch {
    staged: Vec<Staged>,
}

struct Staged {
    asked: PathBuf,
    temporary: Temporary,
    target: PathBuf,
}

impl Batch {
    /// Writes one file of the batch; a target that is not a regular file gets its data here and now.
    pub fn write(&mut self, path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let refused = |e| Error::io(path, "write", e);
        match destination(path).map_err(refused)? {
            Destination::Straight => {
                // Appending keeps what a redirected standard output holds already.
                let file = OpenOptions::new().append(true).open(path).map_err(refused)?;
                fill_file(file, fill).map_err(refused)
            }
            Destination::Rename { folder, name } => {
                let (temporary, file) = Temporary::create(&folder).map_err(refused)?;
                fill_file(file, fill).map_err(refused)?;
                self.staged.push(Staged { asked: path.to_path_buf(), temporary, target: folder.join(name) });
                Ok(())
            }
        }
    }

    /// Renames all files to their targets, in the order in which they were written. If one cannot be renamed,
    /// those before it stay and the rest is removed.
    pub fn commit(self) -> Result<()> {
        for staged in self.staged {
            staged.temporary.rename(&staged.target, &staged.asked).map_err(|e| Error::io(&staged.asked, "write", e))?;
        }
        Ok(())
    }
}

fn fill_file(file: File, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(BUFFER, file);
    fill(&mut out)?;
    out.flush()
}

enum Destination {
    Straight,
    Rename { folder: PathBuf, name: OsString },
}

/// Where the data for `path` go once links are followed.
fn destination(path: &Path) -> io::Result<Destination> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder: name a file"));
        }
        Ok(found) if !found.is_file() => return Ok(Destination::Straight),
        _ => {}
    }
    let mut hop = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let (folder, name) = split(&hop)?;
        // The links below /proc/self/fd stand for open files, whatever name they show; /dev/stdout leads there.
        if folder.starts_with("/proc") {
            return Ok(Destination::Straight);
        }
        hop = folder.join(&name);
        match fs::symlink_metadata(&hop) {
            Ok(found) if found.is_symlink() => hop = folder.join(fs::read_link(&hop)?),
            Ok(found) => {
                check_unprotected(&hop, &found)?;
                return Ok(Destination::Rename { folder, name });
            }
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Destination::Rename { folder, name }),
            Err(e) => return Err(e),
        }
    }
    Err(io::Error::other("too many symbolic links"))
}

/// Refuses to replace a file that may not be written to: the folder alone decides what can be renamed, but whoever
/// protects a file means its content. The mode counts for the superuser too, who could open it.
fn check_unprotected(file: &Path, found: &fs::Metadata) -> io::Result<()> {
    if found.permissions().readonly() {
        let what = "the file there is read-only: name another, or allow writing to it first (chmod u+w)";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, what));
    }
    OpenOptions::new().append(true).open(file).map(|_| ())
}

/// The folder of `path`, free of links, and the name in it.
fn split(path: &Path) -> io::Result<(PathBuf, OsString)> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "it names no file"))?;
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let real = folder.canonicalize().map_err(|e| {
        if e.kind() == io::ErrorKind::NotFound {
            let what = format!("there is no folder {}: create it first", folder.display());
            io::Error::new(e.kind(), what)
        } else {
            e
        }
    })?;
    Ok((real, name.to_os_string()))
}

/// A file that is removed when dropped, unless it was renamed.
struct Temporary {
    path: PathBuf,
}

impl Temporary {
    fn create(folder: &Path) -> io::Result<(Self, File)> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        loop {
            let n = NEXT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".limitlab-{}-{n}.tmp", std::process::id()));
            let mut ledger = ledger();
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                // Left by a process of the same number that was killed.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                opened => {
                    let file = opened?;
                    ledger.temporary.push(path.clone());
                    return Ok((Temporary { path }, file));
                }
            }
        }
    }

    fn rename(self, target: &Path, asked: &Path) -> io::Result<()> {
        let mut ledger = ledger();
        let is_first = !ledger.complete.iter().any(|known| known == target);
        let replaces = is_first && target.exists() && !is_same(&self.path, target).unwrap_or(false);
        fs::rename(&self.path, target)?;
        ledger.forget(&self.path);
        if is_first {
            ledger.complete.push(target.to_path_buf());
        }
        if replaces {
            ledger.replaced.push(asked.to_path_buf());
        }
        Ok(())
    }
}

/// Whether two files hold the same bytes; no more of them is in memory than a buffer of each.
fn is_same(a: &Path, b: &Path) -> io::Result<bool> {
    let files = [File::open(a)?, File::open(b)?];
    if files[0].metadata()?.len() != files[1].metadata()?.len() {
        return Ok(false);
    }
    let mut parts = [Vec::new(), Vec::new()];
    loop {
        for (file, part) in files.iter().zip(&mut parts) {
            part.clear();
            file.take(BUFFER as u64).read_to_end(part)?;
        }
        if parts[0] != parts[1] {
            return Ok(false);
        }
        if parts[0].is_empty() {
            return Ok(true);
        }
    }
}

impl Ledger {
    /// Strikes out a temporary file; whether it was there.
    fn forget(&mut self, path: &Path) -> bool {
        let place = self.temporary.iter().position(|known| known == path);
        place.map(|k| self.temporary.swap_remove(k)).is_some()
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if ledger().forget(&self.path) {
            // Nothing sensible is left to do if this fails too.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn write(path: &Path, text: &str) -> Result<()> {
        write_file(path, |out| out.write_all(text.as_bytes()))
    }

    #[test]
    fn a_file_is_created_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for text in ["one", "two", ""] {
            write(&path, text).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn what_is_replaced_is_known_if_it_was_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let [other, late, same, new] = ["other", "late", "same", "new"].map(|name| folder.path().join(name));
        // Longer than is read at once.
        let ours = "ours".repeat(BUFFER);
        fs::write(&other, "theirs").unwrap();
        fs::write(&late, ours.clone() + "!").unwrap();
        fs::write(&same, ours.clone() + "?").unwrap();
        for path in [&other, &late, &same, &new] {
            write(path, &(ours.clone() + "?")).unwrap();
            write(path, "ours, later").unwrap();
        }
        let here: Vec<PathBuf> = replaced().into_iter().filter(|path| path.starts_with(folder.path())).collect();
        assert_eq!(here, [other, late]);
    }

    #[test]
    fn a_failing_fill_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, "old").unwrap();
        let error = write_file(&path, |out| {
            out.write_all(&[b'x'; 3 * BUFFER])?;
            Err(io::Error::other("out of ideas"))
        })
        .unwrap_err();
        assert_eq!(error.to_string(), format!("{}: cannot write: out of ideas", path.display()));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_panicking_fill_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let caught = std::panic::catch_unwind(|| write_file(&path, |_| panic!("on purpose")));
        assert!(caught.is_err());
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn folders_that_are_missing_or_in_the_way_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/a.txt");
        let error = write(&missing, "x").unwrap_err().to_string();
        assert!(error.contains("there is no folder"), "{error}");
        assert!(error.contains("create it first"), "{error}");
        let error = write(folder.path(), "x").unwrap_err().to_string();
        assert!(error.contains("it is a folder"), "{error}");
        assert!(write(Path::new(""), "x").is_err());
        assert!(write(Path::new("/"), "x").is_err());
        assert!(names(folder.path()).is_empty());

        create_dir(missing.parent().unwrap()).unwrap();
        create_dir(missing.parent().unwrap()).unwrap();
        write(&missing, "x").unwrap();
        let error = create_dir(&missing).unwrap_err().to_string();
        assert!(error.contains("cannot create the folder"), "{error}");
    }

    #[test]
    fn targets_are_checked_before_the_work_as_they_are_when_written() {
        let folder = tempfile::tempdir().unwrap();
        let protected = folder.path().join("protected");
        write(&protected, "mine").unwrap();
        let mut permissions = fs::metadata(&protected).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&protected, permissions).unwrap();
        let missing = folder.path().join("no/a");
        for (path, what) in [
            (protected.as_path(), "the file there is read-only: name another"),
            (&missing, "there is no folder"),
            (folder.path(), "it is a folder: name a file"),
        ] {
            let before = check_target(path).unwrap_err().to_string();
            assert!(before.contains(what), "{before}");
            assert_eq!(write(path, "x").unwrap_err().to_string(), before);
        }
        assert_eq!(fs::read_to_string(&protected).unwrap(), "mine");
        check_target(&folder.path().join("fresh")).unwrap();
        allow_replacing(&protected).unwrap();
        check_target(&protected).unwrap();
        write(&protected, "ours").unwrap();
        assert_eq!(names(folder.path()), ["protected"]);
    }

    #[test]
    fn a_batch_appears_as_a_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let mut batch = Batch::default();
        batch.write(&path("a"), |out| out.write_all(b"1")).unwrap();
        assert!(!path("a").exists());
        batch.write(&path("b"), |_| Err(io::Error::other("no"))).unwrap_err();
        drop(batch);
        assert!(names(folder.path()).is_empty());

        let mut batch = Batch::default();
        batch.write(&path("a"), |out| out.write_all(b"1")).unwrap();
        batch.write(&path("b"), |out| out.write_all(b"2")).unwrap();
        batch.commit().unwrap();
        assert_eq!(names(folder.path()), ["a", "b"]);
        assert_eq!(fs::read_to_string(path("b")).unwrap(), "2");
    }

    #[cfg(unix)]
    mod unix {
        use super::*;
        use std::os::unix::fs::{PermissionsExt, symlink};

        #[test]
        fn the_mode_is_the_one_of_a_plainly_created_file() {
            let folder = tempfile::tempdir().unwrap();
            let [plain, ours] = ["plain", "ours"].map(|name| folder.path().join(name));
            fs::write(&plain, "x").unwrap();
            write(&ours, "x").unwrap();
            let mode = |path| fs::metadata(path).unwrap().permissions().mode();
            assert_eq!(mode(&ours), mode(&plain));
        }

        #[test]
        fn links_are_followed_also_relative_chained_and_dangling_ones() {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            fs::create_dir(path("deep")).unwrap();
            symlink("deep/middle", path("link")).unwrap();
            symlink("../target", path("deep/middle")).unwrap();
            for text in ["created through the dangling link", "replaced"] {
                write(&path("link"), text).unwrap();
                assert_eq!(fs::read_to_string(path("target")).unwrap(), text);
            }
            assert!(path("link").is_symlink() && path("deep/middle").is_symlink());
            assert!(!path("target").is_symlink());
            assert_eq!(names(folder.path()), ["deep", "link", "target"]);
        }

        #[test]
        fn a_loop_of_links_is_an_error() {
            let folder = tempfile::tempdir().unwrap();
            let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
            symlink(&b, &a).unwrap();
            symlink(&a, &b).unwrap();
            let error = write(&a, "x").unwrap_err().to_string();
            assert!(error.contains("cannot write"), "{error}");
            assert_eq!(names(folder.path()), ["a", "b"]);
        }
    }

    #[cfg(target_os = "linux")]
    mod linux {
        use super::*;

        #[test]
        fn standard_streams_are_fine_targets_and_are_not_opened_by_the_check() {
            for path in ["/dev/stdout", "/dev/full", "/dev/fd/1"] {
                check_target(Path::new(path)).unwrap();
            }
        }

        #[test]
        fn a_full_device_is_an_error_and_stays_a_device() {
            let full = Path::new("/dev/full");
            let error = write(full, "x").unwrap_err().to_string();
            assert!(error.starts_with("/dev/full: cannot write: "), "{error}");
            write(Path::new("/dev/null"), "x").unwrap();
            assert!(!fs::metadata("/dev/null").unwrap().is_file());
        }

        #[test]
        fn an_open_file_named_by_its_number_is_written_in_place() {
            use std::os::fd::AsRawFd;
            let folder = tempfile::tempdir().unwrap();
            let mut file = File::create(folder.path().join("a")).unwrap();
            file.write_all(b"first, ").unwrap();
            for place in ["/proc/self/fd", "/dev/fd"] {
                let path = PathBuf::from(format!("{place}/{}", file.as_raw_fd()));
                write(&path, "more").unwrap();
            }
            assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "first, moremore");
        }
    }
}
