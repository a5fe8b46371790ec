//! EDS file (CiA 306) from the object table, for masters that configure their devices.

use super::objects::{self, OBJECTS, Object, RECORDS};
use crate::frame::NodeId;
use crate::service::Type;
use core::fmt::{self, Write};

/// Writes the EDS of a block.
///
/// # Errors
/// Those of `out`.
pub fn eds(node: NodeId, out: &mut impl Write) -> fmt::Result {
    write!(
        out,
        "[FileInfo]\nFileName=guideblock.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n\
         Description=Preload of a linear guide block. Made by can-wire; do not edit.\n\n\
         [DeviceInfo]\nVendorName=guideblock\nVendorNumber=0\nProductName=guideblock\nProductNumber=0\n\
         RevisionNumber=0\nBaudRate_10=0\nBaudRate_20=0\nBaudRate_50=0\nBaudRate_125=0\nBaudRate_250=0\n\
         BaudRate_500=1\nBaudRate_800=0\nBaudRate_1000=0\nSimpleBootUpMaster=0\nSimpleBootUpSlave=1\n\
         Granularity=0\nDynamicChannelsSupported=0\nGroupMessaging=0\nNrOfRXPDO=0\nNrOfTXPDO=0\n\
         LSS_Supported=0\n\n[Comments]\nLines=2\n\
         Line1=Node {}. The cyclic frames are described by guideblock.dbc, not by PDO objects.\n\
         Line2=Layout of CiA 301; no conformance is claimed.\n\n",
        node.get()
    )?;
    out.write_str("[DummyUsage]\n")?;
    for kind in 1..=7 {
        writeln!(out, "Dummy{kind:04}=0")?;
    }
    list(out, "MandatoryObjects", |index| matches!(index, 0x1000 | 0x1001 | 0x1018))?;
    list(out, "OptionalObjects", |index| index < 0x2000 && !matches!(index, 0x1000 | 0x1001 | 0x1018))?;
    list(out, "ManufacturerObjects", |index| index >= 0x2000)?;
    for index in indices() {
        if let Some(parts) = objects::parts(index) {
            let name = RECORDS.iter().find(|(i, _)| *i == index).map_or("", |(_, name)| name);
            writeln!(out, "\n[{index:X}]\nParameterName={name}\nObjectType=0x9\nSubNumber={}", parts + 1)?;
            writeln!(
                out,
                "\n[{index:X}sub0]\nParameterName=Highest sub-index supported\nObjectType=0x7\nDataType=0x0005\n\
                 AccessType=const\nDefaultValue={parts}\nPDOMapping=0"
            )?;
        }
        for object in OBJECTS.iter().filter(|o| o.index == index) {
            entry(out, object)?;
        }
    }
    Ok(())
}

fn entry(out: &mut impl Write, object: &Object) -> fmt::Result {
    match object.sub {
        0 => writeln!(out, "\n[{:X}]", object.index)?,
        sub => writeln!(out, "\n[{:X}sub{sub:X}]", object.index)?,
    }
    writeln!(out, ";{}", object.comment())?;
    let object_type = if object.kind == Type::Domain { 0x2 } else { 0x7 };
    writeln!(
        out,
        "ParameterName={}\nObjectType=0x{object_type:X}\nDataType=0x{:04X}\nAccessType={}",
        object.name(),
        object.kind as u8,
        object.access.name()
    )?;
    let widest = match object.kind {
        Type::U8 => 0xFF,
        Type::I16 | Type::U16 => 0xFFFF,
        Type::U32 | Type::Domain => u32::MAX,
    };
    if object.access.writable() && object.kind != Type::Domain && (object.low, object.high) != (0, widest) {
        writeln!(out, "LowLimit={}\nHighLimit={}", object.low, object.high)?;
    }
    writeln!(out, "PDOMapping=0")
}

/// Indices in order, each once.
fn indices() -> impl Iterator<Item = u16> {
    let before = core::iter::once(None).chain(OBJECTS.iter().map(|o| Some(o.index)));
    OBJECTS.iter().zip(before).filter(|(o, before)| Some(o.index) != *before).map(|(o, _)| o.index)
}

fn list(out: &mut impl Write, title: &str, wanted: impl Fn(u16) -> bool) -> fmt::Result {
    let chosen = || indices().filter(|index| wanted(*index));
    writeln!(out, "\n[{title}]\nSupportedObjects={}", chosen().count())?;
    for (n, index) in chosen().enumerate() {
        writeln!(out, "{}=0x{index:04X}", n + 1)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::{String, ToString};

    #[test]
    fn the_eds_in_the_repository_is_that_of_node_1() {
        let mut text = String::new();
        eds(NodeId::FIRST, &mut text).unwrap();
        assert!(
            text == include_str!("../../guideblock.eds"),
            "write can-wire/guideblock.eds anew: guideblock eds > can-wire/guideblock.eds"
        );
    }

    #[test]
    fn every_object_of_the_table_has_its_section_and_no_other() {
        let mut text = String::new();
        eds(NodeId::FIRST, &mut text).unwrap();
        let sections: std::vec::Vec<&str> = text.lines().filter(|l| l.starts_with('[')).collect();
        for object in &OBJECTS {
            let (index, sub) = (object.index, object.sub);
            let section = if sub == 0 { std::format!("[{index:X}]") } else { std::format!("[{index:X}sub{sub:X}]") };
            assert!(sections.contains(&section.as_str()), "{section}");
            let body = text.split(&section).nth(1).unwrap().split("\n[").next().unwrap();
            assert!(body.contains(&std::format!("AccessType={}\n", object.access.name())), "{section}");
        }
        // headings, lists, records and their sub 0
        assert_eq!(sections.len(), 7 + OBJECTS.len() + 2 * RECORDS.len());
        assert!(text.is_ascii() && text.lines().all(|l| l.len() < 255), "{}", text.len().to_string());
    }
}
