! my_law: an elastic interface with Coulomb friction and separation.
!
! (1) t_n = K_n ([u_n] + g),  t_t = t_t0 + K_t [u_t]      trial; g: gap at the start
! (2) t_n > 0: the interface opens, t = 0, g = t_n / K_n
! (3) |t_t| <= -t_n tan phi, otherwise it slides
!
! Tension and opening are positive.
module law
  use pilum
  implicit none

  ! Numbers of the internal variables.
  integer, parameter :: PLASTIC_SLIP = 1, GAP = 2, N_STATES = 2

contains

  ! In the order in which `prepare` and `update` receive them.
  subroutine describe()
    call describe_law(id='my_law', name='interface with Coulomb friction', version='0.1.0', &
      author='unknown', licence='unknown', &
      doc='Linear elasticity, Coulomb friction without dilatancy, separation.', &
      references='none', prepare=prepare, update=update)
    call add_parameter('normal_stiffness', 'K_n', 'kPa/m', 'Stiffness against closing.', &
      above=0.0_dp, usual=[1e3_dp, 1e12_dp])
    call add_parameter('shear_stiffness', 'K_t', 'kPa/m', 'Stiffness against sliding.', &
      above=0.0_dp, usual=[1e3_dp, 1e12_dp])
    call add_parameter('friction_angle', 'phi', 'deg', 'Friction angle.', &
      lower=0.0_dp, below=90.0_dp, usual=[0.0_dp, 50.0_dp])
    call add_state(PLASTIC_SLIP, 'plastic_slip', 'xi', 'm', 'Slip, accumulated over both directions.')
    call add_state(GAP, 'gap', 'g', 'm', 'Opening; 0 in contact.')
    call add_formulation(PILUM_H_INTERFACE_2D, N_STATES)
  end subroutine

  ! Once: what the update needs instead of the parameters. A text in `refusal` refuses them.
  subroutine prepare(p, refusal)
    real(dp), intent(inout) :: p(:)
    character(len=*), intent(inout) :: refusal
    p(3) = tan(p(3)*acos(-1.0_dp)/180)
  end subroutine

  ! One point over one increment. No allocation, no output, nothing remembered between calls.
  subroutine update(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    real(dp) :: k_n, k_t, tan_phi, normal, shear, excess, sign_of_shear
    k_n = p(1)
    k_t = p(2)
    tan_phi = p(3)
    status = PILUM_OK
    ! (1) In contact the traction carries what is known of the past, open the gap does.
    normal = point%flux(1) + k_n*(point%state(GAP) + point%increment(1))
    shear = point%flux(2) + k_t*point%increment(2)
    ! Arrays have room for solids in space: here the first two components count.
    end%tangent(1, :2) = [k_n, 0.0_dp]
    end%tangent(2, :2) = [0.0_dp, k_t]
    end%state(PLASTIC_SLIP) = point%state(PLASTIC_SLIP)
    if (normal > 0) then ! (2)
      end%state(GAP) = point%state(GAP) + point%increment(1) + point%flux(1)/k_n
      if (tangent == TANGENT_CONSISTENT) end%tangent = 0
      return
    end if
    end%flux(1) = normal
    end%flux(2) = shear
    excess = abs(shear) + normal*tan_phi
    if (excess > 0) then ! (3)
      sign_of_shear = sign(1.0_dp, shear)
      end%flux(2) = -sign_of_shear*normal*tan_phi
      end%state(PLASTIC_SLIP) = end%state(PLASTIC_SLIP) + excess/k_t
      if (tangent == TANGENT_CONSISTENT) then
        end%tangent(2, :2) = [-sign_of_shear*k_n*tan_phi, 0.0_dp]
      end if
    end if
  end subroutine
end module

! What the host calls first.
function pilum_entry(host) result(library) bind(C, name='pilum_entry')
  use law
  implicit none
  type(c_ptr), value :: host
  type(c_ptr) :: library
  if (.not. described()) call describe()
  library = the_library()
end function
