!> The version of the package; a test holds it to the one in fpm.toml.
module frb_release
    implicit none
    private

    public :: version

    character(*), parameter :: version = '0.2.0'

end module frb_release
