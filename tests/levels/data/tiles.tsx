<?xml version="1.0" encoding="UTF-8"?>
<tileset version="1.10" tiledversion="1.10.2" name="tiles" tilewidth="16" tileheight="16" tilecount="4" columns="4">
 <image source="tiles.png" width="64" height="16"/>
 <tile id="0">
  <properties><property name="friction" type="float" value="0.7"/></properties>
  <objectgroup draworder="index" id="2"><object id="1" x="0" y="0" width="16" height="16"/></objectgroup>
 </tile>
 <tile id="1">
  <objectgroup draworder="index" id="2"><object id="1" x="0" y="16"><polygon points="0,0 16,0 16,-16"/></object></objectgroup>
 </tile>
 <tile id="2" type="dynamic">
  <properties><property name="density" type="float" value="3"/><property name="label" value="x"/></properties>
  <objectgroup draworder="index" id="2"><object id="1" x="0" y="0" width="16" height="16"><ellipse/></object></objectgroup>
 </tile>
</tileset>
