//! A device as the rest of the program sees it: typed buffers, kernels, and programs made of both.

use crate::error::Result;
use bytemuck::Pod;
use std::marker::PhantomData;

/// What a buffer holds: the same bits on host and device.
pub trait Element: Pod {
    /// Its name in the shaders: a struct's, or that of a plain type as the shaders write it.
    const NAME: &'static str;
}

macro_rules! elements {
    ($($element:ty = $name:literal),* $(,)?) => {
        $(impl Element for $element {
            const NAME: &'static str = $name;
        })*
    };
}
elements!(
    u32 = "u32",
    f32 = "f32",
    [u32; 2] = "vec2u",
    [f32; 2] = "vec2f",
    [u32; 4] = "vec4u",
    [f32; 4] = "vec4f"
);

/// Makes structs that lie in a shader under the same name [`Element`]s.
macro_rules! shader_structs {
    ($($name:ident),* $(,)?) => {
        $(impl $crate::compute::Element for $name {
            const NAME: &'static str = stringify!($name);
        })*
    };
}
pub(crate) use shader_structs;

/// Who else than the shaders touches a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Host {
    /// Nobody.
    None,
    /// The host writes it, or it is cleared.
    Writes,
    /// The host reads it, or it is copied from.
    Reads,
    /// Both.
    Both,
    /// A uniform that the host writes.
    Uniform,
}

/// A buffer of elements `T`. Its name is the one that the shaders bind it by.
#[derive(Debug)]
pub struct Buffer<T> {
    name: &'static str,
    host: Host,
    element: PhantomData<fn() -> T>,
}

impl<T> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Buffer<T> {}

impl<T: Element> Buffer<T> {
    /// Only the tables of buffers make one: what is not in a table does not compile.
    pub(crate) const fn new(name: &'static str, host: Host) -> Self {
        Self { name, host, element: PhantomData }
    }

    /// Which one it is.
    pub const fn id(self) -> Id {
        Id(self.name)
    }

    /// What a table says about it.
    pub const fn spec(self) -> Spec {
        Spec { id: self.id(), element: T::NAME, size: size_of::<T>() as u64, host: self.host }
    }

    /// Bytes of an element.
    pub const fn size(self) -> u64 {
        size_of::<T>() as u64
    }
}

/// Which buffer, whatever it holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(&'static str);

impl Id {
    /// Name, as in the shaders.
    pub const fn name(self) -> &'static str {
        self.0
    }
}

impl<T: Element> From<Buffer<T>> for Id {
    fn from(buffer: Buffer<T>) -> Self {
        buffer.id()
    }
}

/// A line of a table of buffers.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// Which buffer.
    pub id: Id,
    /// Name of its elements in the shaders.
    pub element: &'static str,
    /// Bytes of an element.
    pub size: u64,
    /// Who else than the shaders touches it.
    pub host: Host,
}

/// An entry point of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Kernel {
    /// The file, shaders/FILE.wgsl.
    pub file: &'static str,
    /// The entry point.
    pub entry: &'static str,
    /// Threads of a workgroup.
    pub width: u32,
}

/// A shader with its kernels, and the buffers that are its own.
#[derive(Debug)]
pub struct Program {
    /// The file, shaders/NAME.wgsl.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
    /// Its entry points.
    pub kernels: &'static [Kernel],
    /// Buffers that no other program uses.
    pub buffers: &'static [Spec],
}

/// Threads of a workgroup; `WORKGROUP` in shaders/common.wgsl.
pub const WORKGROUP: u64 = 256;
/// Threads of a workgroup of the monitor; `WIDTH` in shaders/monitor.wgsl.
pub const MONITOR_WIDTH: u64 = 128;

/// The kernels of shaders/FILE.wgsl, one constant each, and their list `ALL`; called as the shader calls them.
macro_rules! kernels {
    ($file:ident[$width:expr]: $($entry:ident)*) => {
        #[allow(non_upper_case_globals, missing_docs)]
        #[doc = concat!("Kernels of shaders/", stringify!($file), ".wgsl.")]
        pub mod $file {
            use $crate::compute::Kernel;
            $(pub const $entry: Kernel =
                Kernel { file: stringify!($file), entry: stringify!($entry), width: $width as u32 };)*
            /// All of them.
            pub const ALL: &[Kernel] = &[$($entry),*];
            /// The shader.
            pub const TEXT: &str =
                include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/", stringify!($file), ".wgsl"));
        }
    };
}
pub(crate) use kernels;

/// Buffers of a program, one constant each, and their list `ALL`; called as the shader calls them.
macro_rules! buffers {
    ($($(#[$doc:meta])* $name:ident: $element:ty, $host:ident;)*) => {
        #[allow(non_upper_case_globals, missing_docs)]
        /// Buffers of the program.
        pub mod buffer {
            // Plain elements need none of it.
            #[allow(unused_imports)]
            use super::*;
            use $crate::compute::{Buffer, Host, Spec};
            $($(#[$doc])* pub const $name: Buffer<$element> = Buffer::new(stringify!($name), Host::$host);)*
            /// All of them.
            pub const ALL: &[Spec] = &[$($name.spec()),*];
        }
    };
}
pub(crate) use buffers;

/// Buffers and kernels of a device.
pub trait Compute {
    /// Makes a buffer hold at least `bytes`. What it held is lost if it has to grow.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`] if the plan has no such buffer or the device no room.
    fn reserve(&mut self, buffer: Id, bytes: u64) -> Result<()>;
    /// Writes to the start of a buffer.
    ///
    /// # Errors
    /// As [`Compute::reserve`].
    fn upload(&mut self, buffer: Id, data: &[u8]) -> Result<()>;
    /// Records kernels, each with its number of workgroups, to run one after the other.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`] if the plan has no such kernel.
    fn dispatch(&mut self, kernels: &[(Kernel, u64)]) -> Result<()>;
    /// Waits for what was recorded, and reads the start of a buffer.
    ///
    /// # Errors
    /// [`crate::error::Error::Gpu`] if the device is lost.
    fn download(&mut self, buffer: Id, bytes: u64) -> Result<Vec<u8>>;
}
