//! The format of a mesh file, told by its content or else by its name, and its unpacking.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::LoadError;

/// The bytes at a file's start that tell its format.
const HEAD: usize = 4096;

/// Maximum size of an unpacked file, in bytes. A packed file may unpack to a thousand times its size.
const MAX_UNPACKED: u64 = 1 << 32;

const GZIP: &[u8] = b"\x1F\x8B";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Obj,
    Gltf,
    Stl,
    Ply,
}

/// The starts of files that people take for meshes, with what they are. A `<` starts web pages and
/// the XML formats.
const FOREIGN: &[(&[u8], &str)] = &[
    (
        b"version https://git-lfs",
        "a Git LFS pointer, not the mesh itself: fetch it with `git lfs pull`",
    ),
    (b"PK\x03\x04", "a ZIP archive: unpack the mesh from it"),
    (
        b"Kaydara FBX",
        "an FBX file, which is not supported: export glTF",
    ),
    (
        b"BLENDER",
        "a Blender file, which is not supported: export glTF",
    ),
    (
        b"PXR-USDC",
        "a USD file, which is not supported: export glTF",
    ),
    (b"\xABKTX ", "a KTX texture, perhaps a grid, and not a mesh"),
    (
        b"<",
        "a web page or XML, not a mesh: perhaps a failed download",
    ),
];

impl Format {
    /// Returns the format of a file of `length` bytes that starts with `head`.
    pub(super) fn detect(head: &[u8], length: u64, name: &str) -> Result<Self, LoadError> {
        let head = &head[..head.len().min(HEAD)];
        let text = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
        let text = text.trim_ascii_start();
        if let Some((_, what)) = FOREIGN.iter().find(|(start, _)| text.starts_with(start)) {
            return Err(LoadError::Foreign(what));
        }
        if head.starts_with(b"glTF") || text.starts_with(b"{") {
            return Ok(Self::Gltf);
        }
        if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
            return Ok(Self::Ply);
        }
        if is_binary_stl(head, length) || is_ascii_stl(text) {
            return Ok(Self::Stl);
        }
        Self::of_name(name).ok_or(LoadError::UnknownFormat)
    }

    fn of_name(name: &str) -> Option<Self> {
        let extension = Path::new(name).extension()?.to_ascii_lowercase();
        match extension.to_str()? {
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            "stl" => Some(Self::Stl),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

/// Whether the length is what the count behind the 80 bytes of a binary STL file's header asks for.
fn is_binary_stl(head: &[u8], length: u64) -> bool {
    let count = head.get(80..84).and_then(|bytes| bytes.try_into().ok());
    let count = u64::from(count.map_or(0, u32::from_le_bytes));
    count > 0 && length == 84 + 50 * count
}

fn is_ascii_stl(text: &[u8]) -> bool {
    let is_facet = |word: &[u8]| word == b"facet" || word == b"endsolid";
    text.starts_with(b"solid") && text.split(u8::is_ascii_whitespace).any(is_facet)
}

/// Reads a file whose format is known: others may be of any size.
pub(super) fn read_file(path: &Path, name: &str) -> Result<Vec<u8>, LoadError> {
    // Reading a device or a pipe might never end.
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(LoadError::NotAFile);
    }
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    file.by_ref().take(HEAD as u64).read_to_end(&mut bytes)?;
    if !bytes.starts_with(GZIP) {
        Format::detect(&bytes, metadata.len(), name)?;
    }
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the content of a file, unpacked if it is packed by gzip, and its name without `.gz`.
pub(super) fn unpacked(bytes: Vec<u8>, name: &str) -> Result<(Vec<u8>, &str), LoadError> {
    if !bytes.starts_with(GZIP) {
        return Ok((bytes, name));
    }
    let mut content = Vec::new();
    let mut decoder = MultiGzDecoder::new(&bytes[..]).take(MAX_UNPACKED);
    if let Err(error) = decoder.read_to_end(&mut content) {
        return Err(LoadError::Gzip(error.to_string()));
    }
    if content.len() as u64 == MAX_UNPACKED {
        return Err(LoadError::Gzip("it has more than 4 GiB".into()));
    }
    let inner = match name
        .len()
        .checked_sub(3)
        .and_then(|at| name.split_at_checked(at))
    {
        Some((inner, ending)) if ending.eq_ignore_ascii_case(".gz") => inner,
        _ => name,
    };
    Ok((content, inner))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::super::LoadedMesh;
    use super::*;

    const OBJ: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn detect(head: &[u8], name: &str) -> Result<Format, LoadError> {
        Format::detect(head, head.len() as u64, name)
    }

    #[test]
    fn content_goes_before_the_name() {
        let mut stl = vec![b'x'; 84 + 50];
        stl[80..84].copy_from_slice(&1_u32.to_le_bytes());
        for (head, name, expected) in [
            (OBJ, "a.OBJ", Format::Obj),
            (b"glTF\x02", "a.obj", Format::Gltf),
            (b" {\"asset\"", "a.json", Format::Gltf),
            (b"ply\r\nformat", "scan", Format::Ply),
            (b"solid a\nfacet normal", "a.obj", Format::Stl),
            (&stl, "a.obj", Format::Stl),
            (b"", "a.stl", Format::Stl),
            (b"solid", "a.obj", Format::Obj),
        ] {
            assert_eq!(detect(head, name).unwrap(), expected, "{name}");
        }
    }

    #[test]
    fn what_is_no_mesh_is_named() {
        for (head, word) in [
            (&b"<!DOCTYPE html>"[..], "web page"),
            (b"version https://git-lfs.github.com/spec/v1\noid", "LFS"),
            (b"PK\x03\x04", "ZIP"),
            (b"\xABKTX 20\xBB", "KTX"),
        ] {
            let error = detect(head, "a.obj").unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        for name in ["obj", "a.txt", "a.gz"] {
            assert!(
                matches!(detect(OBJ, name), Err(LoadError::UnknownFormat)),
                "{name}"
            );
        }
    }

    #[test]
    fn packed_files_are_unpacked() {
        let level = flate2::Compression::default();
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), level);
        encoder.write_all(OBJ).unwrap();
        let packed = encoder.finish().unwrap();
        let load = |bytes: &[u8], name: &str| {
            LoadedMesh::from_bytes(name, bytes.to_vec(), &|_| unreachable!())
        };
        let mesh = load(&packed, "a.obj.GZ").unwrap();
        assert_eq!(mesh.mesh.triangles().len(), 1);
        assert_eq!(mesh.name, "a.obj.GZ");
        assert_eq!(mesh.blake3, blake3::hash(&packed).to_hex().as_str());
        assert!(matches!(load(&packed, "a"), Err(LoadError::UnknownFormat)));
        let cut = &packed[..packed.len() - 9];
        assert!(matches!(load(cut, "a.obj.gz"), Err(LoadError::Gzip(_))));
    }
}
